# Faults of workers.

fault kill_worker 20 2 "a worker is killed (kill -9), another comes"
kill_worker() {
	farm
	worker w0
	worker w1
	job
	each_time one_worker_dies
	finish_job
	grep -q 'name="w1".*\(the peer hung up\|reset\|broken pipe\)' "$DIR/coordinator.log" || fail "$NAME: nobody was killed"
	blameless
}
one_worker_dies() {
	says "w$i" event=connect
	kill -9 "$WORKER"
	worker "w$((i + 1))"
}
blameless() {
	[ "$(value "$ID" failures)" = 0 ] || fail "$NAME: counted as $(value "$ID" failures) failures"
}

fault leave_worker 20 2 "SIGTERM of a worker: it finishes its epoch"
leave_worker() {
	farm
	worker w0
	worker w1
	job
	each_time one_worker_leaves
	finish_job
	blameless
}
one_worker_leaves() {
	says "w$i" event=connect
	stop "$WORKER"
	[ "$CODE" -eq 0 ] || fail "$NAME: leaving ended with $CODE"
	worker "w$((i + 1))" $GRACE
}

fault hurry_worker 20 1 "SIGTERM of a worker without grace: it gives its epoch up"
hurry_worker() {
	GRACE="--grace 0"
	leave_worker
	GRACE=
}

fault stop_worker 3 1 "a worker stands still (SIGSTOP) until it is missed, then goes on"
stop_worker() {
	farm
	worker w0
	worker w1
	job
	each_time one_worker_sleeps
	finish_job
	blameless
}
one_worker_sleeps() {
	kill -STOP "$WORKER"
	until_true 30 has_said coordinator 'event=peer_closed .*name="w1"\|event=peer_fault .*nothing heard' $i || fail "$NAME: the silent worker is not missed"
	kill -CONT "$WORKER"
	until_true 30 has_said w1 event=connect\  $((i + 1)) || fail "$NAME: it does not come back"
}

fault slow_worker 1 1 "a worker is slowed down to a tenth: others compute its leases, too"
slow_worker() {
	farm
	worker w0
	worker w1
	(
		while kill -STOP "$WORKER" 2>/dev/null; do
			sleep 0.18
			kill -CONT "$WORKER" 2>/dev/null || break
			sleep 0.02
		done
	) &
	PIDS="$PIDS $!"
	job
	finish_job
	[ "$(value "$ID" duplicates)" -gt 0 ] || fail "$NAME: nothing was computed twice"
	kill -CONT "$WORKER"
}

fault repeat_worker 1 1 "a worker sends every result twice"
repeat_worker() {
	farm
	worker w0 --test-repeat
	worker w1
	job
	finish_job
	grep -q 'event=batch_repeated' "$DIR/coordinator.log" || fail "$NAME: nothing was repeated"
}

fault hang_worker 2 1 "a thread of a worker hangs in a lease, and heartbeats go on"
hang_worker() {
	farm
	worker w0
	worker w1
	job
	each_time one_thread_hangs
	finish_job
}
# The job is held until it has come, lest the others have nothing left for it; if it has ended there is nothing to hang in.
one_thread_hangs() {
	"$BIN/hslt-job" hold "$ID" 2>>"$DIR/hold.log" || { [ $i -gt 1 ] && return 0; } || fail "$NAME: $(tail -n 1 "$DIR/hold.log")"
	worker "h$i" --threads 2 --stall 0.5 --test-hang 1
	says "h$i" event=connect
	"$BIN/hslt-job" release "$ID" 2>>"$DIR/hold.log" || fail "$NAME: $(tail -n 1 "$DIR/hold.log")"
	CODE=0
	wait "$WORKER" || CODE=$?
	[ "$CODE" -eq 75 ] || fail "$NAME: it ended with $CODE"
	# if others have computed it meanwhile, or the job has ended, there is nothing to give back
	[ "$TIMES" -eq 1 ] || grep -q "event=lease_failed job=$ID .*no progress for 0.5 s" "$DIR/h$i.log" ||
		grep -q "event=lease_taken_back job=$ID" "$DIR/coordinator.log" || fail "$NAME: h$i keeps its lease"
}
