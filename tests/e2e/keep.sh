# SPDX-License-Identifier: Apache-2.0
# Results of finished jobs are deleted by age and by space, and a client that asks for a deleted one gets the time of
# deletion; a live job keeps everything.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-job

JOB="--integrator path --size 64x48 --spp 4"
start_coordinator --keep-gb 0.00000001 --heartbeat 5
# The client is slow: it hears of the job's end after the coordinator has looked twice for results to delete.
"$BIN/hslt-submit" "$BOX" -o "$DIR/first.exr" $JOB --wait >"$DIR/first" 2>>"$DIR/submit.log" &
CLIENT=$!
PIDS="$PIDS $CLIENT"
until_true 20 is_state j1 queued || fail "j1 is $(value j1 state)"
kill -STOP $CLIENT
start_worker w1
until_true 30 is_state j1 done || fail "j1 is $(value j1 state)"
sleep 5
kill -CONT $CLIENT
wait $CLIENT || fail "what somebody waits for is gone before it is fetched: hslt-submit ends with $?"
[ -s "$DIR/first.exr" ] || fail "hslt-submit wrote no image"
until_true 20 test ! -e "$DIR/spool/jobs/j1/result.exr" || fail "ten bytes are kept, and its result is still there"
stop $COORDINATOR_PID

LISTEN=$COORDINATOR start_coordinator
second=$(submit "$BOX" -o "$DIR/second.exr" $JOB)
until_true 30 is_state j2 done || fail "j2 is $(value j2 state)"
stop $COORDINATOR_PID
LISTEN=$COORDINATOR start_coordinator
sleep 1
[ -s "$DIR/spool/jobs/j2/result.exr" ] || fail "thirty days are less than a second"
"$BIN/hslt-job" fetch j2 -o "$DIR/second.exr"
first_end=$(value j1 ended) second_end=$(value j2 ended)
[ "$first_end" ] && [ "$second_end" ] || fail "the status does not say when they ended"
stop $COORDINATOR_PID

# A limit such that j2 is old enough now, and j1 is not ten times as old, or its record would go as well.
seconds=$(awk -v a="$first_end" -v b="$second_end" 'BEGIN { print (b - a > 2 ? b - a : 2) }')
sleep "$(awk -v s="$seconds" -v b="$second_end" -v now="$(date +%s.%N)" 'BEGIN { print (now - b < s ? s - now + b : 0) }')"
LISTEN=$COORDINATOR start_coordinator --keep-days "$(awk -v s="$seconds" 'BEGIN { printf "%.9f", s / 86400 }')"
until_true 20 test ! -e "$DIR/spool/jobs/j2/result.exr" || fail "its result is still there"
for j in j1 j2; do
	if "$BIN/hslt-job" fetch $j -o "$DIR/none.exr" 2>"$DIR/fetch.log"; then
		fail "$j was fetched"
	fi
	grep -q "$j: its result was cleared on 20[0-9][0-9]-" "$DIR/fetch.log" || fail "it says: $(cat "$DIR/fetch.log")"
	is_state $j done || fail "$j is $(value $j state)"
	grep -q "event=job_cleared job=$j what=result" "$DIR/coordinator.log" || fail "the log does not say that $j went"
done
echo "two results went, by space and by age, and who asks is told"
