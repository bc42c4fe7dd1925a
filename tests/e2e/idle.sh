# SPDX-License-Identifier: Apache-2.0
# --idle-exit: a worker without work for that time exits with 0, and not earlier, also if there is no coordinator.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-job hslt-render hslt-compare

JOB="--integrator pssmlt --bootstrap 20000 --mutations 100000 --epoch 200"
"$BIN/hslt-render" "$BOX" -o "$DIR/alone.exr" $JOB 2>>"$DIR/render.log"
seconds() {
	date +%s%N | cut -b1-11 # tenths of a second
}
# leaves NAME TENTHS: starts a worker that must exit after so many tenths of a second without work
leaves() {
	begin=$(seconds)
	start_worker "$1" --idle-exit "$(awk -v t="$2" 'BEGIN { print t / 10 }')"
	code=0
	wait $WORKER || code=$?
	[ $code -eq 0 ] || fail "it ended with $code"
	[ $(($(seconds) - begin)) -ge $(($2 - 1)) ] || fail "it left too soon"
}
start_coordinator
# On a busy machine the time may be over before the worker has connected: then it gets more time.
for tenths in 8 80 600; do
	leaves nothing $tenths
	! grep -q 'event=connect ' "$DIR/nothing.log" || break
done
grep -q "event=stop text=\"no lease for $(awk -v t=$tenths 'BEGIN { print t / 10 }') s\"" "$DIR/nothing.log" || fail "it does not say why"
until_true 5 grep -q 'name="nothing".*ended the connection' "$DIR/coordinator.log" || fail "it did not say goodbye"

# A job keeps the worker; it exits afterwards. A worker without the option, or with 0, stays.
submit "$BOX" -o "$DIR/farm.exr" $JOB >"$DIR/id"
for tenths in 4 80 600; do
	leaves works $tenths
	! grep -q 'event=world_built ' "$DIR/works.log" || break
done
is_state j1 done || fail "it left, and j1 is $(value j1 state)"
"$BIN/hslt-job" fetch j1 -o "$DIR/farm.exr"
same "$DIR/alone.exr" "$DIR/farm.exr"
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
