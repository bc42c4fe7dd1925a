# Faults of workers.

fault kill_worker 20 2 "a worker is killed (kill -9), another comes"
kill_worker() {
	farm
	worker w0
	worker w1
	job
	each_time one_worker_dies
	finish_job
	grep -q 'name="w1".*\(the peer hung up\|reset\)' "$DIR/coordinator.log" || fail "$NAME: nobody was killed"
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
	until_true 10 has_said coordinator 'event=peer_closed .*name="w1"' $i || fail "$NAME: the silent worker is not missed"
	kill -CONT "$WORKER"
	until_true 10 has_said w1 event=connect\  $((i + 1)) || fail "$NAME: it does not come back"
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
