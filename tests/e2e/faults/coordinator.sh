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
