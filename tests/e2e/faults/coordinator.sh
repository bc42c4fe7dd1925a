# Faults of the coordinator.

fault kill_coordinator 20 2 "the coordinator is killed (kill -9) and started again"
kill_coordinator() {
	farm
	worker w0
	worker w1
	job
	each_time coordinator_dies
	finish_job
	[ "$(grep -c 'state=restored' "$DIR/coordinator.log")" -ge "$TIMES" ] || fail "$NAME: it did not go on $TIMES times"
}
coordinator_dies() {
	kill -9 "$COORDINATOR_PID"
	again
}

fault checkpoint_coordinator 20 1 "the same, with a checkpoint after every few results"
checkpoint_coordinator() {
	farm --journal 0.05
	worker w0
	worker w1
	job
	each_time coordinator_dies_early
	finish_job
	grep -q 'state=restored .*checkpoint=[1-9]' "$DIR/coordinator.log" || fail "$NAME: never from a checkpoint"
}
coordinator_dies_early() {
	kill -9 "$COORDINATOR_PID"
	again --journal 0.05
}

fault leave_coordinator 10 1 "SIGTERM of the coordinator, and it is started again"
leave_coordinator() {
	farm
	worker w0
	worker w1
	job
	each_time coordinator_leaves
	finish_job
}
coordinator_leaves() {
	stop "$COORDINATOR_PID"
	[ "$CODE" -eq 0 ] || fail "$NAME: it ended with $CODE"
	again
}

fault patient_client 5 1 "the coordinator is killed while hslt-submit --wait waits for the image"
patient_client() {
	farm
	worker w0
	worker w1
	# shellcheck disable=SC2086
	"$BIN/hslt-submit" "$BOX" -o "$DIR/image.exr" $JOB --wait >"$DIR/id" 2>>"$DIR/wait.log" &
	waiting=$!
	PIDS="$PIDS $waiting"
	ID=j1
	each_time coordinator_dies
	wait $waiting || fail "$NAME: hslt-submit --wait ended with $?"
	[ -s "$DIR/image.exr" ] || fail "$NAME: no image"
	has_said wait 'trying again' "$TIMES" || fail "$NAME: it did not call again"
	finish_job
	# nobody comes back: it says how to get the image, and the status says that nobody is there
	# shellcheck disable=SC2086
	"$BIN/hslt-submit" "$BOX" -o "$DIR/late.exr" $JOB --wait --patience 0.5 >"$DIR/id2" 2>>"$DIR/give-up.log" &
	waiting=$!
	PIDS="$PIDS $waiting"
	until_true 30 test -s "$DIR/id2" || fail "$NAME: no second job"
	kill -9 "$COORDINATOR_PID"
	CODE=0
	wait $waiting || CODE=$?
	[ $CODE -eq 75 ] || fail "$NAME: hslt-submit ended with $CODE"
	grep -q "hslt-job fetch j2 -o $DIR/late.exr" "$DIR/give-up.log" || fail "$NAME: it says: $(tail -n 1 "$DIR/give-up.log")"
	"$BIN/hslt-status" >"$DIR/status.log" 2>&1 && fail "$NAME: somebody is there"
	grep -q 'no coordinator\|not there\|refused' "$DIR/status.log" || fail "$NAME: hslt-status says: $(cat "$DIR/status.log")"
}
