# SPDX-License-Identifier: Apache-2.0
# A limit on the size of files (ulimit -f, LimitFSIZE, the queue of a cluster) ends no program: the coordinator puts a
# job on hold when its journal has reached the limit, other jobs go on, and without the limit the job continues to the
# same bits.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-job hslt-render hslt-compare

JOB="--integrator path --spp 8 --size 160x120 --groups 4"
is_refused() {
	grep -q 'level=error event=spool_fault job=j1 .*File too large' "$DIR/coordinator.log"
}
ulimit -S -f 512
start_coordinator
ulimit -S -f unlimited
start_worker w
# shellcheck disable=SC2086
id=$(submit "$BOX" -o "$DIR/box.exr" $JOB)
until_true 60 is_refused || fail "no limit was met: $(value "$id" state)"
until_true 10 is_state "$id" held || fail "$id is $(value "$id" state)"
case $(value "$id" why) in
*"File too large"*) ;;
*) fail "it is held because: $(value "$id" why)" ;;
esac
"$BIN/hslt-submit" "$BOX" -o "$DIR/small.exr" --integrator path --spp 1 --size 16x12 --wait >"$DIR/small.log" 2>&1 ||
	fail "another job cannot be done: $(cat "$DIR/small.log")"
kill -0 "$COORDINATOR_PID" || fail "the coordinator is gone"
stop "$COORDINATOR_PID"
[ "$CODE" = 0 ] || fail "the coordinator ended with $CODE"

LISTEN=$COORDINATOR start_coordinator
until_true 120 is_state "$id" done || fail "$id is $(value "$id" state)"
"$BIN/hslt-job" fetch "$id" -o "$DIR/box.exr" 2>>"$DIR/fetch.log"
# shellcheck disable=SC2086
"$BIN/hslt-render" "$BOX" -o "$DIR/alone.exr" $JOB 2>"$DIR/render.log"
same "$DIR/box.exr" "$DIR/alone.exr"

# A program that cannot write its image gives the reason, and leaves no file behind.
ulimit -S -f 8
# shellcheck disable=SC2086
code 1 "$BIN/hslt-render" "$BOX" -o "$DIR/large.exr" $JOB
grep -q 'large.exr: cannot write: File too large' "$DIR/err.log" || fail "hslt-render says: $(tail -n 1 "$DIR/err.log")"
[ -z "$(find "$DIR" -name 'large.exr*')" ] || fail "a part of the image stays"
echo "a limit of the size of files holds a job, and ends no program"
