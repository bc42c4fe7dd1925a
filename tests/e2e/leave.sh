# SPDX-License-Identifier: Apache-2.0
# SIGTERM: a worker finishes or returns its leases and exits with 0; the job loses nothing and nobody is blamed. So does
# a worker whose thread is stuck building a scene; without SIGTERM it detects the stuck thread and exits with 75, but
# not if the building only takes long.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-compare

JOB="--integrator hslt --bootstrap 20000 --mutations 1500000"
start_coordinator -v
start_worker stays
STAYS=$WORKER
submit "$BOX" -o "$DIR/calm.exr" $JOB --wait >/dev/null
start_worker leaves
leaves=$WORKER
start_worker hurries --grace 0
hurries=$WORKER
id=$(submit "$BOX" -o "$DIR/left.exr" $JOB)
until_true 20 is_beyond "$id" 0.3 || fail "$id does not get on"
stop $leaves
[ $CODE -eq 0 ] || fail "leaving ended with $CODE"
stop $hurries
[ $CODE -eq 0 ] || fail "leaving in a hurry ended with $CODE"
until_true 30 is_state "$id" done || fail "$id is $(value "$id" state)"
[ "$(value "$id" failures)" = 0 ] || fail "leaving was counted as a failure"
"$BIN/hslt-job" fetch "$id" -o "$DIR/left.exr"
same "$DIR/calm.exr" "$DIR/left.exr"
echo "workers leave in peace"

# ---- scenes while they are built ----

${CC:-cc} -shared -fPIC -O1 -o "$DIR/build.so" "$HERE/build.c" -ldl 2>"$DIR/cc.log" || fail "no compiler: $(cat "$DIR/cc.log")"
stop $STAYS
# start_builder SECONDS NAME [OPTION...]: starts a worker that takes so long to build a scene
start_builder() {
	seconds=$1
	shift
	LD_PRELOAD=$DIR/build.so HSLT_BUILD=$seconds start_worker "$@"
}
id=$(submit "$BOX" -o "$DIR/built.exr" --integrator path --spp 8)
start_builder 600 never --grace 100
until_true 10 grep -qsx building "$DIR/never.log" || fail "nobody builds $id"
begun=$(date +%s)
stop $WORKER
[ $CODE -eq 0 ] || fail "leaving while a scene is built ended with $CODE"
[ $(($(date +%s) - begun)) -lt 90 ] || fail "it took $(($(date +%s) - begun)) s, the grace is 100 s"
until_true 5 grep -q 'event=peer_closed .*name="never" .*ended the connection' "$DIR/coordinator.log" || fail "it said nothing"
[ "$(value "$id" failures)" = 0 ] || fail "leaving while a scene is built was counted as a failure"

start_builder 600 stands --stall 0.8
CODE=0
wait $WORKER || CODE=$?
[ $CODE -eq 75 ] || fail "a building that stands still ended with $CODE"
"$BIN/hslt-job" log "$id" | grep -q 'event=lease_failed .*worker="stands" .*no progress for 0.8 s in building' || fail "nobody says that the building hangs"

HSLT_BUILD_TICKS=1 start_builder 3 slow --stall 2
until_true 20 is_state "$id" done || fail "$id is $(value "$id" state)"
grep -q 'event=world_built .*seconds=\([3-9]\|[1-9][0-9]\)' "$DIR/slow.log" || fail "it was not slow: $(cat "$DIR/slow.log")"
stop $WORKER
[ $CODE -eq 0 ] || fail "the slow one ended with $CODE"
echo "nobody waits for a building that never ends"
