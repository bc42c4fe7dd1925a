# --idle-exit: a worker that nobody has work for leaves with 0, not before, also when there is no coordinator.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-render hslt-compare

JOB="--integrator pssmlt --bootstrap 20000 --mutations 100000 --epoch 200"
"$BIN/hslt-render" "$BOX" -o "$DIR/alone.exr" $JOB 2>>"$DIR/render.log"
seconds() {
	date +%s%N | cut -b1-11 # tenths
}
start_coordinator
begin=$(seconds)
start_worker nothing --idle-exit 0.8
code=0
wait $WORKER || code=$?
[ $code -eq 0 ] || fail "it ended with $code"
[ $(($(seconds) - begin)) -ge 7 ] || fail "it left too soon"
grep -q 'event=stop text="no lease for 0.8 s"' "$DIR/nothing.log" || fail "it does not say why"
until_true 5 grep -q 'name="nothing".*said goodbye' "$DIR/coordinator.log" || fail "it did not say goodbye"

# A job keeps it; it leaves afterwards. One without the option, or with 0, stays.
start_worker works --idle-exit 0.4
works=$WORKER
submit "$BOX" -o "$DIR/farm.exr" $JOB --wait >"$DIR/id" || fail "the job: $?"
same "$DIR/alone.exr" "$DIR/farm.exr"
code=0
wait $works || code=$?
[ $code -eq 0 ] || fail "it ended with $code after the job"
[ "$(value j1 failures)" = 0 ] || fail "leaving was counted as a failure"

start_worker lingers --idle-exit 0
lingers=$WORKER
until_true 5 grep -qs 'event=connect ' "$DIR/lingers.log" || fail "it does not connect"
stop $COORDINATOR_PID
code=0
start_worker alone --idle-exit 0.5
wait $WORKER || code=$?
[ $code -eq 0 ] || fail "without a coordinator it ended with $code"
kill -0 $lingers 2>/dev/null || fail "0 means never"
stop $lingers
[ $CODE -eq 0 ] || fail "it ended with $CODE"
echo "idle workers leave, others stay"
