# SPDX-License-Identifier: Apache-2.0
# A coordinator whose spool was lost assigns the same job numbers again. A worker that still has data of the old j1 must
# not mistake the new j1 for it: neither its world nor its results are used, and it is not blamed for them.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-job hslt-render hslt-compare
JOB="--integrator hslt --bootstrap 8000 --mutations 400000 --chains 64"

"$BIN/hslt-render" "$BOX" -o "$DIR/alone.exr" $JOB -D light=3 2>"$DIR/render.log"
start_coordinator
start_worker w1
worker=$WORKER
id=$(submit "$BOX" -o "$DIR/old.exr" $JOB --mutations 100000000)
until_true 30 is_state "$id" running || fail "$id is $(value "$id" state)"
kill -STOP "$(renders "$worker")"
kill -9 $COORDINATOR_PID
wait $COORDINATOR_PID 2>/dev/null || :
rm -rf "$DIR/spool"
LISTEN=$COORDINATOR
start_coordinator
again=$(submit "$BOX" -o "$DIR/new.exr" $JOB -D light=3)
[ "$again" = "$id" ] || fail "the new job is $again, the old one was $id"
kill -CONT "$(renders "$worker")"
until_true 60 is_state "$again" done || fail "$again is $(value "$again" state): $(value "$again" why)"
"$BIN/hslt-job" fetch "$again" -o "$DIR/new.exr"
same "$DIR/alone.exr" "$DIR/new.exr"
grep -q 'the coordinator has another job with this number' "$DIR/w1.log" || fail "the worker did not notice"
[ "$("$BIN/hslt-status" | grep -c quarantined)" -eq 0 ] || fail "the worker is blamed"
echo "a number that was given out twice"
