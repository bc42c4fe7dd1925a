# SPDX-License-Identifier: Apache-2.0
# Faults of workers.

fault kill_worker 20 2 "a worker is killed (kill -9), another joins"
kill_worker() {
	farm
	worker w0
	worker w1
	job
	each_time one_worker_dies
	finish_job
	grep -q 'event=peer_closed .*name="w1" text=' "$DIR/coordinator.log" || fail "$NAME: nobody was killed"
	blameless
}
one_worker_dies() {
	says coordinator "event=peer_hello .*name=\"w$i\""
	kill -9 "$WORKER"
	worker "w$((i + 1))"
}
blameless() {
	[ "$(value "$ID" failures)" = 0 ] ||
		fail "$NAME: counted as $(value "$ID" failures) failures: $(grep event=lease_failed "$DIR/coordinator.log" | head -n 3)"
}

fault hoard_leases 1 1 "a worker claims 4,096 threads, takes leases, sends heartbeats and returns nothing"
hoard_leases() {
	farm
	worker w0
	says w0 event=connect\ 
	"$PYTHON" "$HERE/faults/hoard.py" "${COORDINATOR#*:}" "$(sed -n 's/.*event=start.* fingerprint="\([^"]*\)".*/\1/p' "$DIR/w0.log")" >"$DIR/hoard.log" 2>&1 &
	PIDS="$PIDS $!"
	says coordinator 'event=peer_hello.*name="hoarder"'
	job
	says hoard lease
	finish_job
	blameless
}

fault leave_worker 20 2 "a worker gets SIGTERM: it finishes its epoch"
leave_worker() {
	farm
	worker w0
	worker w1 $GRACE
	job
	each_time one_worker_leaves
	finish_job
	blameless
}
one_worker_leaves() {
	says "w$i" event=connect\ 
	stop "$WORKER"
	[ "$CODE" -eq 0 ] || fail "$NAME: leaving ended with $CODE"
	worker "w$((i + 1))" $GRACE
}

fault hurry_worker 20 1 "a worker gets SIGTERM, with no grace period: it gives up its epoch"
hurry_worker() {
	GRACE="--grace 0"
	leave_worker
	GRACE=
}

fault stop_worker 3 1 "a worker is stopped (SIGSTOP) until it is given up, then continues"
stop_worker() {
	farm
	worker w0
	worker w1
	says w1 event=connect\ 
	job
	each_time one_worker_sleeps
	finish_job
	blameless
}
one_worker_sleeps() {
	missed='event=peer_\(closed\|fault\) .*name="w1" text="silent for too long"'
	calls=$(times_said w1 event=connect\ )
	silences=$(times_said coordinator "$missed")
	stand_still "$WORKER"
	until_true 30 has_said coordinator "$missed" $((silences + 1)) || fail "$NAME: the silent worker is not missed"
	go_on "$WORKER"
	until_true 30 has_said w1 event=connect\  $((calls + 1)) || fail "$NAME: it does not come back"
}

fault slow_worker 1 1 "a worker is slowed down to a tenth: others compute its leases, too"
slow_worker() {
	farm
	worker w0
	faulty_worker w1 slow=10
	says w1 event=connect\ 
	job
	finish_job
	[ "$(value "$ID" duplicates)" -gt 0 ] || fail "$NAME: nothing was computed twice"
}

fault repeat_worker 1 1 "a worker sends every result twice"
repeat_worker() {
	farm
	faulty_worker w0 repeat
	says w0 event=connect\ 
	worker w1
	job
	finish_job
	grep -q 'event=batch_repeated' "$DIR/coordinator.log" || fail "$NAME: nothing was repeated"
}

fault hang_worker 2 1 "a thread of a worker hangs in a lease while heartbeats continue"
hang_worker() {
	farm
	worker w0
	first=$WORKER
	worker w1
	OTHER=$WORKER
	job
	each_time one_thread_hangs
	finish_job
}
# The job is held until this worker has connected, and the others are stopped until it has a lease, so that they leave
# one for it.
one_thread_hangs() {
	hold_job
	stand_still "$first" "$OTHER"
	faulty_worker "h$i" hang=1 --threads 2 --stall 0.5
	says "h$i" event=connect\ 
	release_job
	says "h$i" event=world_built
	go_on "$first" "$OTHER"
	CODE=0
	wait "$WORKER" || CODE=$?
	[ "$CODE" -eq 75 ] || fail "$NAME: it ended with $CODE"
	# if others have computed the lease meanwhile, or the job has ended, there is nothing to give back
	[ "$TIMES" -eq 1 ] || grep -q "event=lease_failed job=$ID .*no progress for 0.5 s" "$DIR/h$i.log" ||
		grep -q "event=lease_taken_back job=$ID" "$DIR/coordinator.log" || fail "$NAME: h$i keeps its lease"
}

fault crash_worker 5 1 "a signal kills the rendering process in the middle of a lease"
crash_worker() {
	farm
	worker w0
	OTHER=$WORKER
	job
	each_time one_process_crashes
	finish_job
	[ "$(value "$ID" failures)" -ge "$TIMES" ] || fail "$NAME: $(value "$ID" failures) failures"
}
# The worker stays, reports what ended the process, and pauses. The other one is stopped meanwhile, so that it does not
# compute that lease.
one_process_crashes() {
	hold_job
	faulty_worker "h$i" crash=1
	says "h$i" event=connect\ 
	stand_still "$OTHER"
	release_job
	says "h$i" "event=process_lost signal=11 .*leases=1"
	says coordinator "event=lease_failed job=$ID worker=\"h$i\" own=0 text=\"box.xml: .*ended by SIGSEGV .*($ID, "
	go_on "$OTHER"
	kill -0 "$WORKER" || fail "$NAME: h$i is gone"
	stop "$WORKER" # exits with 1 if another lease has ended it meanwhile
	[ "$CODE" -le 1 ] || fail "$NAME: h$i ended with $CODE"
}

fault kill_renderer 5 1 "the machine runs out of memory: the rendering process gets SIGKILL"
kill_renderer() {
	farm
	worker w0
	worker w1
	says w1 event=connect\ 
	job
	each_time one_renderer_killed
	finish_job
}
one_renderer_killed() {
	calls=$(times_said w1 event=connect\ )
	kill -9 "$(renders "$WORKER")"
	until_true 30 has_said w1 event=process_lost $i || fail "$NAME: nobody misses it"
	until_true 30 has_said w1 event=connect\  $((calls + 1)) || fail "$NAME: it does not come back"
	kill -0 "$WORKER" || fail "$NAME: the worker is gone"
}

fault extreme_numbers 9 3 "a scene with impossible numbers is submitted"
extreme_numbers() {
	farm
	worker w0
	worker w1
	job
	each_time one_extreme_scene
	finish_job
	blameless
	! grep -q event=process_lost "$DIR"/w?.log || fail "$NAME: a process was lost"
}
# Each of these scenes once ended all workers, and hslt-render by a signal.
one_extreme_scene() {
	case $((i % 3)) in
	0) set -- glass '<float name="intIOR" value="1.33"' '<float name="intIOR" value="1e-300"' intIOR=1e-300 ;;
	1) set -- metal 'origin="0, 1.3, 5"' 'origin="3e38, 1.3, 5"' "3e+38 times\|scene radii away" ;;
	2) set -- metal '<rgb name="k" value="3.9, 2.45, 2.14"' '<rgb name="k" value="3.9, 3e38, 2.14"' "k=3e+38" ;;
	esac
	mkdir "$DIR/extreme$i"
	cp "$HERE/../scenes/numbers/"* "$DIR/extreme$i"
	sed "s|$2|$3|" "$HERE/../scenes/numbers/$1.xml" >"$DIR/extreme$i/$1.xml"
	! cmp -s "$HERE/../scenes/numbers/$1.xml" "$DIR/extreme$i/$1.xml" || fail "$NAME: no such number in $1.xml"
	for program in hslt-submit hslt-render; do
		code 1 "$BIN/$program" "$DIR/extreme$i/$1.xml" -o "$DIR/no.exr" --spp 1
		grep -q "$1.xml:[0-9]*: .*\($4\)" "$DIR/err.log" || fail "$NAME: $program says $(cat "$DIR/err.log")"
	done
}
