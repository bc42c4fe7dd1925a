# SPDX-License-Identifier: Apache-2.0
# Faults of the network, by a proxy between one of two workers and the coordinator (proxy.py).

through_proxy() {
	farm
	rm -f "$DIR/proxy-port"
	"$PYTHON" "$HERE/faults/proxy.py" "$DIR/proxy-port" "${COORDINATOR#*:}" "$DIR/order" 2>>"$DIR/proxy.log" &
	PIDS="$PIDS $!"
	until_true 30 test -s "$DIR/proxy-port" || fail "$NAME: no proxy"
	worker w0
	OTHER=$WORKER
	worker w1 --coordinator "127.0.0.1:$(cat "$DIR/proxy-port")"
	says w1 event=connect
	job
	each_time "$@"
	finish_job
	blameless
}

# happens ACTION FIELD: does this to the next message of that kind, or to one of another job if this job ended without
# one
happens() {
	echo "$1 $2" >"$DIR/order.tmp"
	mv "$DIR/order.tmp" "$DIR/order"
	for attempt in 1 2 3 4 5 6; do
		until_true 30 is_taken_or_late || fail "$NAME: there was nothing to do it to"
		[ -e "$DIR/order" ] || return 0
		job
	done
	fail "$NAME: six jobs were done by the other worker alone"
}
is_taken_or_late() {
	[ ! -e "$DIR/order" ] || is_state "$ID" done
}

# and the worker reconnects
is_cut() {
	calls=$(times_said w1 event=connect\ )
	happens "$@"
	until_true 30 has_said w1 event=connect\  $((calls + 1)) || fail "$NAME: the worker does not come back"
}

fault cut_result 10 1 "a connection is cut in the middle of a result"
cut_result() {
	through_proxy is_cut cut 22
}

fault cut_grant 10 1 "a connection is cut in the middle of a grant"
cut_grant() {
	through_proxy is_cut cut 21
}

fault stall_result 3 1 "half a result arrives, and then nothing"
stall_result() {
	through_proxy is_stalled
}
# The other worker is stopped meanwhile, so that it does not do the job alone.
is_stalled() {
	stand_still "$OTHER"
	is_cut stall 22
	go_on "$OTHER"
}

fault slow_result 3 1 "results take longer to arrive than a worker may be silent"
slow_result() {
	through_proxy is_slow
}
# The other worker is stopped until the result has arrived, so that it does not do the job alone meanwhile.
is_slow() {
	stand_still "$OTHER"
	for try in 1 2 3 4 5; do # again if the machine stood still for a second, which also cuts the worker off
		calls=$(times_said w1 event=connect\ )
		rm -f "$DIR/order.done"
		happens slow 22
		until_true 30 is_through_or_cut || fail "$NAME: the result does not come"
		! is_called_again || continue
		go_on "$OTHER"
		return 0
	done
	fail "$NAME: the worker is cut off"
}
is_called_again() {
	has_said w1 event=connect\  $((calls + 1))
}
is_through_or_cut() {
	[ -e "$DIR/order.done" ] || is_called_again
}

fault late_result 3 1 "results arrive after their worker was given up"
late_result() {
	through_proxy is_late
}
# The other worker is stopped until the last message is late and its sender was given up, so that it does not do the job
# alone.
is_late() {
	stand_still "$OTHER"
	happens late 22
	[ "$i" -eq "$TIMES" ] || return 0
	for try in 1 2 3 4 5; do # again if the coordinator stood still, because then it gives up no worker
		! until_true 1 is_missed || break
		happens late 22
	done
	is_missed || fail "$NAME: the late worker is not missed"
	go_on "$OTHER"
}
is_missed() {
	grep -q 'name="w1" text="silent' "$DIR/coordinator.log"
}

fault twice_result 10 1 "the network delivers results twice"
twice_result() {
	through_proxy is_twice
}
# The other worker is stopped meanwhile. The second copy of a job's last result is refused, since the job is over.
is_twice() {
	stand_still "$OTHER"
	repeats=$(times_said coordinator event=batch_repeated)
	for try in 1 2 3 4 5; do
		happens twice 22
		until_true 30 is_repeated_or_ended || fail "$NAME: nothing is repeated"
		has_said coordinator event=batch_repeated $((repeats + 1)) || continue
		go_on "$OTHER"
		return 0
	done
	fail "$NAME: nothing was repeated"
}
is_repeated_or_ended() {
	has_said coordinator event=batch_repeated $((repeats + 1)) || is_state "$ID" done
}

fault flip_bits 12 3 "the network flips a bit of a result, of a grant, of a heartbeat"
flip_bits() {
	through_proxy is_flipped
	[ "$("$BIN/hslt-status" --json | grep -o '"garbledConnections":[0-9]*' | cut -d: -f2)" -eq \
		"$(grep -c event=peer_garbled "$DIR/coordinator.log")" ] || fail "$NAME: the coordinator counts other connections than it tells of"
}
# Messages in both directions, with a payload and without. The other worker is stopped meanwhile, so that it does not do
# the job alone.
is_flipped() {
	stand_still "$OTHER"
	flipped=$(cat "$DIR/coordinator.log" "$DIR/w1.log" | grep -c event=peer_garbled) || :
	case $((i % 3)) in
	1) is_cut flip 22 ;;
	2) is_cut flip 21 ;;
	0) is_cut flip 3 ;;
	esac
	until_true 30 is_told $((flipped + 1)) || fail "$NAME: nobody noticed"
	go_on "$OTHER"
}
is_told() {
	[ "$(cat "$DIR/coordinator.log" "$DIR/w1.log" | grep -c event=peer_garbled)" -ge "$1" ]
}

fault deaf_client 3 1 "clients, workers and status readers request everything and read nothing"
deaf_client() {
	farm
	worker w0
	worker w1
	job
	each_time nobody_reads
	finish_job
}
nobody_reads() {
	before=$(awk '/^VmRSS/ { print $2 }' "/proc/$COORDINATOR_PID/status")
	"$PYTHON" "$HERE/faults/deaf.py" "${COORDINATOR#*:}" "${ID#j}" "$DIR/status" >"$DIR/deaf.log" 2>&1 || fail "$NAME: $(cat "$DIR/deaf.log")"
	after=$(awk '/^VmRSS/ { print $2 }' "/proc/$COORDINATOR_PID/status")
	[ $((after - before)) -lt 65536 ] || fail "$NAME: the coordinator grew from $before to $after KB"
}

fault crowd 2 1 "2,000 connections send nothing, 2,000 more send garbage or a hello that is refused: the log stays short, the job goes on"
crowd() {
	start_coordinator --heartbeat 0.2
	worker w0
	worker w1
	i=0
	while [ $i -lt "$TIMES" ]; do
		i=$((i + 1))
		crowd_comes
	done
	again # it logs what it finds
	release_job
	finish_job
	blameless
}
# The job runs meanwhile; then it is held, so that it does not end before the coordinator is started again.
crowd_comes() {
	lines=$(grep -c . "$DIR/coordinator.log")
	before=$(date +%s)
	"$PYTHON" "$HERE/faults/crowd.py" "${COORDINATOR#*:}" >"$DIR/crowd.log" 2>&1 &
	PIDS="$PIDS $!"
	says crowd idle
	[ "$i" -gt 1 ] && release_job || job
	share=$(awk -v i="$i" -v n="$TIMES" 'BEGIN { print i / (n + 2) }')
	until_true 60 is_beyond "$ID" "$share" || fail "$NAME: $ID is at $(value "$ID" progress)"
	attempts=0
	until "$BIN/hslt-job" hold "$ID" 2>>"$DIR/hold.log" && ! is_beyond "$ID" 0.9; do
		attempts=$((attempts + 1))
		[ $attempts -lt 9 ] || fail "$NAME: nine jobs ended too early: $(tail -n 1 "$DIR/hold.log")"
		is_state "$ID" done || release_job
		job
		until_true 60 is_beyond "$ID" "$share" || fail "$NAME: $ID is at $(value "$ID" progress)"
	done
	says crowd done 60
	until_true 30 all_told || fail "$NAME: of 1,000 connections that were refused $(told) are told of"
	said=$(($(grep -c . "$DIR/coordinator.log") - lines))
	most=$((2 * (100 + 5 * ($(date +%s) - before + 1)) + 50)) # for two kinds of lines
	[ $said -le $most ] || fail "$NAME: $said lines, at most $most"
	[ "$i" -lt "$TIMES" ] || kill -9 "$COORDINATOR_PID"
}
# how many refusals the log has shown since then, and how many it has counted
told() {
	tail -n +$((lines + 1)) "$DIR/coordinator.log" |
		awk '/ event=peer_(garbled|refused) / { n++ } / event=log_withheld of=peer_(garbled|refused) / { sub(/.* more=/, ""); n += $0 } END { print n + 0 }'
}
all_told() {
	[ "$(told)" -ge 1000 ]
}
