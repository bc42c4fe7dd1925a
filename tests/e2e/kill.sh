# SPDX-License-Identifier: Apache-2.0
# One worker is killed (kill -9) halfway, and another comes late, in a scene with motion: the bits are those of
# hslt-render.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-compare hslt-render

JOB="--integrator hslt --bootstrap 20000 --mutations 2000000"
SCENE=$DIR/moving.xml
sed -e 's|<float name="fov" value="40"/>|&<float name="shutter_close" value="1"/>|' \
	-e 's|</scene>|<shape type="sphere"><ref id="white"/><animation name="to_world"><transform time="0"><scale value="0.3"/></transform>|' \
	"$BOX" >"$SCENE"
echo '<transform time="1"><scale value="0.3"/><translate x="0.5" y="-0.4"/></transform></animation></shape></scene>' >>"$SCENE"
start_coordinator
start_worker calm
"$BIN/hslt-render" "$SCENE" -o "$DIR/calm.exr" $JOB --path "$(dirname "$BOX")" 2>"$DIR/calm.log" || fail "hslt-render: $(cat "$DIR/calm.log")"
"$BIN/hslt-render" --explain "$SCENE" --path "$(dirname "$BOX")" 2>/dev/null | grep -q '^motion  *on' || fail "nothing moves"

start_worker victim
victim=$WORKER
until_true 10 grep -q 'event=peer_hello.*name="victim"' "$DIR/coordinator.log" || fail "it does not come"
id=$(submit "$SCENE" --path "$(dirname "$BOX")" -o "$DIR/disturbed.exr" $JOB)
until_true 20 is_beyond "$id" 0.4 || fail "$id does not get on"
kill -9 $victim
start_worker late
until_true 30 is_state "$id" done || fail "$id is $(value "$id" state)"
"$BIN/hslt-job" fetch "$id" -o "$DIR/disturbed.exr"
same "$DIR/calm.exr" "$DIR/disturbed.exr"
grep -q 'name="victim".*the peer hung up\|name="victim".*reset\|name="victim".*broken pipe' "$DIR/coordinator.log" || fail "nobody was killed"
[ "$(value "$id" failures)" = 0 ] || fail "a killed worker is nobody's fault"
echo "equal bits with a worker killed and one late, of a scene in which things move"
