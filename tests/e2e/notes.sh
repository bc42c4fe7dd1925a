# SPDX-License-Identifier: Apache-2.0
# Notes that follow from an image's counters: black scenes and chains that do not move, in hslt-render and on a farm.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-render hslt-compare

BLACK="-D light=0 --integrator pssmlt --spp 16 --target-error 2%"
NO_LIGHT="-D light=0 --integrator path --size 16x16 --target-error 2%"
STUCK="--integrator pssmlt --bootstrap 16384 --epoch 2 --mutations 640"

# noted FILE WORDS: checks that the note is in the file
noted() {
	grep -q "note: .*$2" "$1" || fail "it does not say '$2': $(cat "$1")"
}

# Interrupted in the pilot, which takes seconds for a render of an hour: the program ends at once, by the signal, and
# says so.
"$BIN/hslt-render" "$HERE/../scenes/demo/scene.xml" -o "$DIR/pilot.exr" --time 1h 2>"$DIR/pilot.log" &
pilot=$!
PIDS="$PIDS $pilot"
until_true 60 grep -q 'is ignored' "$DIR/pilot.log" || fail "it reads no scene"
stop $pilot
[ $CODE = 143 ] && grep -q 'interrupted before rendering began' "$DIR/pilot.log" && ! grep -q 'chosen by a pilot' "$DIR/pilot.log" ||
	fail "ended in its pilot: $CODE, $(cat "$DIR/pilot.log")"

# Interrupted in its first round: no image is written or mentioned; the bootstrap is kept for the same command.
EARLY="--integrator path --size 64x64 --epoch 512 --spp 65536 --threads 1" # with many threads all leases of a round would end at once
"$BIN/hslt-render" "$BOX" -o "$DIR/early.exr" $EARLY 2>"$DIR/early.log" &
early=$!
PIDS="$PIDS $early"
until_true 60 grep -q '^running' "$DIR/early.log" || fail "its first lease does not end"
stop $early
[ $CODE = 1 ] && grep -q 'interrupted before the first round was complete: there is no image' "$DIR/early.log" ||
	fail "ended before its first round: $CODE, $(cat "$DIR/early.log")"
[ ! -e "$DIR/early.exr" ] || fail "an image without a round was written"
grep -q 'leases of the bootstrap are kept in .*early.exr.bootstrap, and the same command' "$DIR/early.log" && [ -s "$DIR/early.exr.bootstrap" ] ||
	fail "it does not keep the bootstrap: $(cat "$DIR/early.log")"
"$BIN/hslt-render" "$BOX" -o "$DIR/early.exr" $EARLY 2>"$DIR/again.log" &
early=$!
PIDS="$PIDS $early"
until_true 60 grep -q 'continues from \([0-9]*\) of \1 leases of the bootstrap' "$DIR/again.log" || fail "it does not go on with it: $(cat "$DIR/again.log")"
stop $early
[ $CODE = 1 ] || fail "the second time it ended with $CODE"

# SIGHUP when a terminal closes, which may come twice, acts like SIGTERM, but not if SIGHUP is ignored.
ticks() { # prints the processor time that $hup has used
	sed 's/.*) //' "/proc/$hup/stat" | awk '{ print $12 + $13 }'
}
has_used() {
	[ "$(ticks)" -ge "$1" ]
}
hang_up() { # HOW: env --default-signal or --ignore-signal
	rm -f "$DIR/hup.exr"
	env "$1=HUP" "$BIN/hslt-render" "$BOX" -o "$DIR/hup.exr" --integrator path --size 16x16 --epoch 1 --time 1h 2>"$DIR/hup.log" &
	hup=$!
	PIDS="$PIDS $hup"
	until_true 60 grep -q '^running' "$DIR/hup.log" || fail "it does not run: $(cat "$DIR/hup.log")"
	enough=$(($(ticks) + $(getconf CLK_TCK) / 2)) # enough for several rounds
	until_true 60 has_used $enough || fail "it stands still"
	kill -HUP $hup
	kill -HUP $hup 2>/dev/null || :
}
hang_up --default-signal
CODE=0
wait $hup || CODE=$?
[ $CODE = 1 ] && grep -q 'interrupted: .*hup.exr' "$DIR/hup.log" && [ -s "$DIR/hup.exr" ] || fail "SIGHUP: $CODE, $(cat "$DIR/hup.log")"
hang_up --ignore-signal
sleep 0.5
kill -0 $hup 2>/dev/null || fail "ignored, SIGHUP ends it: $(cat "$DIR/hup.log")"
stop $hup
[ $CODE = 1 ] && [ -s "$DIR/hup.exr" ] || fail "SIGTERM after SIGHUP: $CODE, $(cat "$DIR/hup.log")"

# The bound that stops a render is named as on the command line.
"$BIN/hslt-render" "$BOX" -o "$DIR/ends.exr" --size 8x8 -i path --spp 4 2>"$DIR/ends.log" && grep -q 'stopped by: --spp$' "$DIR/ends.log" ||
	fail "--spp: $(cat "$DIR/ends.log")"
"$BIN/hslt-render" "$BOX" -o "$DIR/ends.exr" --size 8x8 -i path 2>"$DIR/ends.log" && grep -q "stopped by: the scene's samples per pixel" "$DIR/ends.log" ||
	fail "no bound: $(cat "$DIR/ends.log")"
grep -q 'MB for Embree$' "$DIR/ends.log" && ! grep -q '^note: .*is ignored' "$DIR/ends.log" || fail "no notes: $(cat "$DIR/ends.log")"
sed 's/"independent"/"stratified"/; s|filename" value="|&scenes/box/|' "$BOX" >"$DIR/box.xml"
"$BIN/hslt-render" "$DIR/box.xml" --path "$HERE/.." -o "$DIR/ends.exr" --size 8x8 -i path --spp 4 2>"$DIR/ends.log" &&
	grep -q "^note: $DIR/box.xml:15: " "$DIR/ends.log" || fail "notes: $(cat "$DIR/ends.log")"
code 2 "$BIN/hslt-render" "$BOX" -o "$DIR/ends.exr" --json
grep -q -- '--json requires --estimate or --explain' "$DIR/err.log" || fail "--json: $(cat "$DIR/err.log")"

# One group gives no error: that is said, and no number is printed that is none.
for one in "--integrator path --spp 1" "--integrator pssmlt --spp 16 --groups 1"; do
	"$BIN/hslt-render" "$BOX" -o "$DIR/one.exr" --size 16x16 $one --stats "$DIR/one.json" 2>"$DIR/one.log" || fail "$one: ended with $?"
	grep -q 'warning: relative error not known: a single group of samples gives no error; it takes at least 2 samples per pixel' "$DIR/one.log" || fail "$one: $(cat "$DIR/one.log")"
	grep -q '"relMSEDoubt": "a single group of samples' "$DIR/one.json" || fail "$one: --stats gives no reason"
	! grep -E '[^a-z]-?nan[^a-z"]' "$DIR/one.log" "$DIR/one.json" || fail "$one: prints nan"
	grep -aq 'hslt:relMSEDoubt' "$DIR/one.exr" && ! grep -aqE 'hslt:(relMSE|relMSEUpper|bError).double' "$DIR/one.exr" ||
		fail "$one: the header has an error, or no reason for none"
done

"$BIN/hslt-render" "$BOX" -o "$DIR/deep.exr" --size 8x8 -i pssmlt --max-depth 60 --spp 16 2>"$DIR/deep.log" || fail "deep: ended with $?"
noted "$DIR/deep.log" 'chains of pssmlt hold paths of up to 32 edges'
"$BIN/hslt-render" "$BOX" -o "$DIR/deep.exr" --size 8x8 -i pssmlt --max-depth 32 --spp 16 2>"$DIR/deep.log" || fail "deep: ended with $?"
! grep -q 'hold paths' "$DIR/deep.log" || fail "32 edges are too many: $(cat "$DIR/deep.log")"

# The wall of this sphere emits and reflects 99 %: 0.99^128 of its light takes more edges than are simulated.
cat >"$DIR/bright.xml" <<-'XML'
	<scene version="3.0.0"><integrator type="path"/>
	<sensor type="perspective"><transform name="to_world"><lookat origin="0,0,0" target="0,0,1" up="0,1,0"/></transform></sensor>
	<shape type="sphere"><boolean name="flip_normals" value="true"/>
	<bsdf type="diffuse"><spectrum name="reflectance" value="0.99"/></bsdf>
	<emitter type="area"><spectrum name="radiance" value="1"/></emitter></shape></scene>
XML
"$BIN/hslt-render" "$DIR/bright.xml" -o "$DIR/bright.exr" --integrator path --size 16x16 --spp 16 2>"$DIR/bright.log" ||
	fail "the bright sphere: ended with $?"
noted "$DIR/bright.log" '2[789] % of the light is missing: it comes by paths of more edges than are simulated'

# If the inside, which is all that the camera sees, is a back face, hslt-scene check and hslt-submit say so.
sed 's/<boolean name="flip_normals" value="true"\/>//' "$DIR/bright.xml" >"$DIR/back.xml"
words='100 % of the surfaces that the camera sees are black backs'
"$BIN/hslt-scene" check "$DIR/back.xml" >"$DIR/back.log" 2>&1 || fail "hslt-scene: the back: ended with $?"
noted "$DIR/back.log" "$words"

start_coordinator
start_worker w1
"$BIN/hslt-submit" "$DIR/back.xml" -o "$DIR/back.exr" --integrator path --size 16x16 --spp 1 >/dev/null 2>"$DIR/back.log" ||
	fail "hslt-submit: the back: ended with $?"
noted "$DIR/back.log" "$words"
# Parts of a scene that the reader ignores or replaces are in the log, the status and the header, and both programs
# write the same.
cat >"$DIR/fork.xml" <<-'XML'
	<scene version="3.0.0"><sensor type="perspective"/><emitter type="constant"/><integrator type="path"/>
	<shape type="sphere"><bsdf type="irawan"/></shape>
	<emitter type="astroobject"/></scene>
XML
LENIENT="--lenient --integrator path --size 8x8 --spp 2"
"$BIN/hslt-render" "$DIR/fork.xml" -o "$DIR/fork.exr" $LENIENT 2>"$DIR/fork.log" || fail "--lenient: ended with $?"
id=$("$BIN/hslt-submit" "$DIR/fork.xml" -o "$DIR/farm-fork.exr" $LENIENT --wait 2>"$DIR/submit-fork.log") || fail "--lenient on a farm: ended with $?"
"$BIN/hslt-status" "$id" >"$DIR/shown-fork"
"$BIN/hslt-status" --json "$id" >"$DIR/shown.json"
"$BIN/hslt-job" log "$id" >"$DIR/log-fork"
for words in '<integrator type="path"> is ignored except for' '<bsdf type="irawan"> is not supported; the plug-in diffuse stands in for it (lenient)' \
	'the plug-in `astroobject` is not supported and left out (lenient)'; do
	noted "$DIR/fork.log" "$words"
	noted "$DIR/submit-fork.log" "$words"
	noted "$DIR/shown-fork" "$words"
	for file in fork.exr farm-fork.exr; do
		grep -aqF "$words" "$DIR/$file" || fail "$file does not say '$words' in its header"
	done
	escaped=$(echo "$words" | sed 's/"/\\"/g')
	grep -qF "$escaped" "$DIR/shown.json" && grep -qF "$escaped" "$DIR/log-fork" || fail "JSON or the log does not say '$words'"
done
same "$DIR/fork.exr" "$DIR/farm-fork.exr"
for kind in black no_light stuck; do # no_light: it would never reach its target error
	[ $kind = black ] && options=$BLACK words='image is black: none of the 16,384 bootstrap samples' ||
		options=$STUCK words='of 320 chain epochs accepted nothing .*16 chains.*longest run: [0-9,]* rejections'
	[ $kind != no_light ] || options=$NO_LIGHT words='image is black: no sample found light'
	"$BIN/hslt-render" "$BOX" -o "$DIR/$kind.exr" $options --stats "$DIR/$kind.json" 2>"$DIR/render-$kind.log" ||
		fail "hslt-render: $kind ended with $?"
	noted "$DIR/render-$kind.log" "$words"
	grep -q "\"note\": \".*$words" "$DIR/$kind.json" || fail "--stats does not say it"
	"$BIN/hslt-submit" "$BOX" -o "$DIR/farm-$kind.exr" $options --wait >"$DIR/id" 2>"$DIR/submit-$kind.log" ||
		fail "hslt-submit: $kind ended with $?"
	noted "$DIR/submit-$kind.log" "$words"
	"$BIN/hslt-status" --json "$(cat "$DIR/id")" | grep -q "\"note\":\".*$words" || fail "the status does not say it"
	"$BIN/hslt-status" "$(cat "$DIR/id")" >"$DIR/shown"
	noted "$DIR/shown" "$words"
	same "$DIR/$kind.exr" "$DIR/farm-$kind.exr"
done
[ "$(value "$(cat "$DIR/id")" stuck)" -gt 0 ] || fail "no count of them"
"$BIN/hslt-status" --json "$(cat "$DIR/id")" | grep -q '"strategies":\[\]' || fail "pssmlt has no strategies"
# The counts survive the coordinator.
stop $COORDINATOR_PID
LISTEN=$COORDINATOR
start_coordinator
"$BIN/hslt-status" "$(cat "$DIR/id")" >"$DIR/shown"
noted "$DIR/shown" 'accepted nothing'
echo "black and stuck: said by both, with the same bits"
