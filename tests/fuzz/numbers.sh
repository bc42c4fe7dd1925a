# SPDX-License-Identifier: Apache-2.0
# Whole scenes with extreme numbers on a farm of real workers: `make fuzz-numbers FUZZ_SECONDS=600`.
#   sh tests/fuzz/numbers.sh BUILD SECONDS [FIRST]
# The programs are those of BUILD (preferably sanitized), the scenes those of tests/worker/render/test_scene_numbers.c
# from number FIRST on (default: by the clock). Three lanes submit scenes, each waiting for its job before the next. Each
# scene must be refused with file and line (exit code 1), be rendered (0, 4, 5), or its job must fail with a sentence from
# a worker (3); every fifth scene is also given to hslt-render. No worker may end, no render process may be lost, and no
# program may be ended by a signal. The last line has the counts.
SECONDS_TO_RUN=${2:-60}
FIRST=${3:-$(($(date +%s) % 100000 * 1000))}
. "$(dirname "$0")/../e2e/lib.sh"
SOURCE=$HERE/../../build/tests/worker/render/test_scene_numbers
need hslt-coordinator hslt-worker hslt-submit hslt-render
[ -x "$SOURCE" ] || lacks "$SOURCE is not built"
LANES=3
END=$(($(date +%s) + SECONDS_TO_RUN))
JOB="--integrator hslt --size 24x20 --bootstrap 1000 --mutations 4000 --chains 32"

has_place() {
	grep -q '\.\(xml\|obj\):[1-9][0-9]*' "$1"
}

# verdict INDEX PROGRAM CODE LOG: judges the exit code of one scene
verdict() {
	case $3 in
	0 | 4 | 5) echo rendered ;;
	1) has_place "$4" && echo refused || echo "BAD $1 $2 refused without a place: $(tail -n 1 "$4")" ;;
	3) grep -q 'ended without an image: ' "$4" && echo "failed $1 $(grep 'ended without an image: ' "$4")" || echo "BAD $1 $2 failed without a word" ;;
	*) echo "BAD $1 $2 ended with $3: $(tail -n 1 "$4")" ;;
	esac
}

lane() {
	n=$((FIRST + $1))
	while [ "$(date +%s)" -lt $END ]; do
		"$SOURCE" --write "$DIR/scenes" $n 1 >>"$DIR/what.$1"
		log=$DIR/scenes/$n/log
		got=0
		# shellcheck disable=SC2086
		timeout 300 "$BIN/hslt-submit" "$DIR/scenes/$n/scene.xml" -o "$DIR/scenes/$n/x.exr" $JOB --wait >"$log" 2>&1 || got=$?
		verdict $n hslt-submit $got "$log" >>"$DIR/verdicts.$1"
		if [ $((n % 5)) -eq 0 ]; then
			got=0
			# shellcheck disable=SC2086
			timeout 300 "$BIN/hslt-render" "$DIR/scenes/$n/scene.xml" -o "$DIR/scenes/$n/y.exr" $JOB --threads 1 >"$log" 2>&1 || got=$?
			if [ $got -eq 1 ] && grep -q SIGFPE "$log"; then
				echo trapped
			else
				verdict $n hslt-render $got "$log"
			fi >>"$DIR/verdicts.$1"
		fi
		rm -rf "$DIR/scenes/$n"
		n=$((n + LANES))
	done
}

mkdir "$DIR/scenes"
start_coordinator --heartbeat 2
start_worker w0
A=$WORKER
start_worker w1
B=$WORKER
LANE_PIDS=
for k in $(seq 0 $((LANES - 1))); do
	lane "$k" &
	LANE_PIDS="$LANE_PIDS $!"
done
PIDS="$PIDS $LANE_PIDS"
for p in $LANE_PIDS; do
	wait "$p"
done
for p in $A $B $COORDINATOR_PID; do
	kill -0 "$p" || fail "a daemon has ended"
done
lost=$(cat "$DIR"/w?.log | grep -c event=process_lost || :)
cat "$DIR"/verdicts.* >"$DIR/verdicts"
of() {
	grep -c "^$1" "$DIR/verdicts" || :
}
grep '^\(BAD\|failed\)' "$DIR/verdicts" || :
echo "from $FIRST: $(wc -l <"$DIR/verdicts") runs in $SECONDS_TO_RUN s: $(of refused) refused with their place, $(of rendered) rendered," \
	"$(of failed) jobs failed by name, $(of trapped) ended hslt-render by an invalid operation, $(of BAD) bad, $lost processes lost, 2 of 2 workers live"
[ "$(of BAD)" = 0 ] && [ "$lost" = 0 ] && [ "$(of rendered)" -gt 0 ] && [ "$(of refused)" -gt 0 ]
