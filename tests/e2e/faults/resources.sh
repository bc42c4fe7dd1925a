# SPDX-License-Identifier: Apache-2.0
# Resources that machines run out of.

# A spool on a disk of its own size, where that is possible.
small_spool() {
	[ -n "${HSLT_OWN_MOUNTS:-}" ] || { cannot "no name spaces for mounts here" && return 1; }
	mkdir "$DIR/spool"
	mount -t tmpfs -o size=64m none "$DIR/spool"
}

fault full_disk 3 1 "the coordinator's disk is full for a while"
full_disk() {
	small_spool || return 0
	farm
	worker w0
	first=$WORKER
	worker w1
	job
	each_time disk_is_full
	finish_job
}
# The workers are stopped until there is no room for their results, so that the job does not end before.
disk_is_full() {
	hold_job
	stand_still "$first" "$WORKER"
	release_job
	fill_disk
	go_on "$first" "$WORKER"
	until_true 30 waits_for_space_or_ended || fail "$NAME: $ID is $(value "$ID" state): $(value "$ID" waiting)"
	if is_state "$ID" done; then
		LATE=yes
		rm "$DIR/spool/filler"
		return 0
	fi
	submit "$BOX" -o "$DIR/none.exr" --integrator path --spp 1 >/dev/null && fail "$NAME: another job was taken"
	grep -q 'No space left\|full' "$DIR/submit.log" || fail "$NAME: the refusal does not say why: $(tail -n 1 "$DIR/submit.log")"
	rm "$DIR/spool/filler"
}
# Repeated, because the coordinator makes room by deleting the films of jobs that have ended.
fill_disk() {
	cat /dev/zero >>"$DIR/spool/filler" 2>/dev/null || :
}
waits_for_space_or_ended() {
	fill_disk
	value "$ID" waiting | grep -q 'No space left' || is_state "$ID" done
}

fault readonly_spool 2 1 "the spool is not writable at a restart of the coordinator"
readonly_spool() {
	small_spool || return 0
	farm
	worker w0
	worker w1
	job
	each_time spool_is_readonly
	finish_job
}
spool_is_readonly() {
	kill -9 "$COORDINATOR_PID"
	wait "$COORDINATOR_PID" 2>/dev/null || :
	mount -o remount,ro "$DIR/spool"
	CODE=0
	timeout 100 "$BIN/hslt-coordinator" --listen "$COORDINATOR" --spool "$DIR/spool" --status-socket "$DIR/status" 2>"$DIR/readonly.log" || CODE=$?
	[ $CODE -eq 1 ] || fail "$NAME: it ended with $CODE"
	tail -n 1 "$DIR/readonly.log" | grep -q 'hslt-coordinator: .*Read-only' || fail "$NAME: it says $(tail -n 1 "$DIR/readonly.log")"
	mount -o remount,rw "$DIR/spool"
	again
}

fault no_descriptors 3 1 "connections use up the coordinator's file descriptors"
no_descriptors() {
	farm
	worker w0
	worker w1
	job
	each_time descriptors_run_out
	finish_job
}
descriptors_run_out() {
	used=$(ls "/proc/$COORDINATOR_PID/fd" | wc -l)
	prlimit --pid "$COORDINATOR_PID" --nofile=$((used + 4)):20000
	"$PYTHON" - "${COORDINATOR#*:}" <<'TEXT' || fail "$NAME: connections"
import socket, sys, time
crowd = []
for k in range(40):
    crowd.append(socket.create_connection(("127.0.0.1", int(sys.argv[1])), 60))
time.sleep(0.5)
TEXT
	timeout 20 "$BIN/hslt-submit" "$BOX" -o "$DIR/none.exr" --integrator path --spp 1 >"$DIR/more" 2>>"$DIR/submit.log" || :
	prlimit --pid "$COORDINATOR_PID" --nofile=20000:20000
	kill -0 "$COORDINATOR_PID" || fail "$NAME: the coordinator is gone"
}

fault no_descriptors_worker 2 1 "a worker runs out of file descriptors while it reconnects"
no_descriptors_worker() {
	farm
	worker w0
	worker w1
	job
	each_time worker_without_descriptors
	finish_job
}
worker_without_descriptors() {
	says w1 event=connect\ 
	calls=$(times_said w1 event=connect\ )
	prlimit --pid "$(renders "$WORKER")" --nofile=3:20000
	kill -9 "$COORDINATOR_PID"
	again
	until_true 30 grep -q 'event=connect_failed .*too many' "$DIR/w1.log" || fail "$NAME: it does not say why"
	prlimit --pid "$(renders "$WORKER")" --nofile=20000:20000
	until_true 30 has_said w1 event=connect\  $((calls + 1)) || fail "$NAME: w1 does not come back"
}

fault no_memory 5 1 "the coordinator gets no memory for a while"
no_memory() {
	farm
	worker w0
	worker w1
	job
	each_time memory_runs_out
	finish_job
}
memory_runs_out() {
	size=$(awk '/^VmSize/ { print $2 }' "/proc/$COORDINATOR_PID/status")
	prlimit --pid "$COORDINATOR_PID" --as=$((size * 1024)):unlimited
	timeout 20 "$BIN/hslt-submit" "$BOX" -o "$DIR/none.exr" --integrator path --spp 1 --size 3000x2000 >"$DIR/large" 2>"$DIR/large.log" || :
	sleep 0.2
	prlimit --pid "$COORDINATOR_PID" --as=unlimited:unlimited 2>/dev/null || :
	[ ! -s "$DIR/large" ] || until_true 30 is_refused_or_gone "$(cat "$DIR/large")" || fail "$NAME: $(cat "$DIR/large") is $(value "$(cat "$DIR/large")" state)"
	kill -0 "$COORDINATOR_PID" 2>/dev/null || again # as a service manager does
	[ ! -s "$DIR/large" ] || until_true 30 is_refused "$(cat "$DIR/large")" || fail "$NAME: $(cat "$DIR/large") is $(value "$(cat "$DIR/large")" state)"
}
# An accepted job fails with a sentence, or continues once there is memory.
is_refused() {
	"$BIN/hslt-job" cancel "$1" 2>>"$DIR/submit.log" || :
	is_state "$1" failed || is_state "$1" cancelled || is_state "$1" done
}
is_refused_or_gone() {
	is_refused "$1" || ! kill -0 "$COORDINATOR_PID" 2>/dev/null
}

fault small_worker 1 1 "a scene is larger than the memory of one of two workers"
small_worker() {
	mkdir -p "$DIR/box/meshes"
	awk 'BEGIN { n = 300
		for (y = 0; y <= n; y++) for (x = 0; x <= n; x++) printf "v %g %g %g\n", x / n - 0.5, y / n - 0.5, 0.1 * sin(x) * sin(y)
		for (y = 0; y < n; y++) for (x = 1; x <= n; x++) { a = y * (n + 1) + x; b = a + n + 1; printf "f %d %d %d\nf %d %d %d\n", a, a + 1, b, b, a + 1, b + 1 } }' \
		>"$DIR/box/meshes/wedge.obj"
	cp "$BOX" "$DIR/box/"
	small=$BOX
	quiet=$QUIET
	BOX=$DIR/box/box.xml
	QUIET=$DIR/alone.exr
	# shellcheck disable=SC2086
	"$BIN/hslt-render" "$BOX" -o "$QUIET" $JOB 2>>"$DIR/render.log"
	farm
	worker w1
	says w1 event=connect\ 
	size=$(awk '/^VmSize/ { print $2 }' "/proc/$(renders "$WORKER")/status")
	prlimit --pid "$(renders "$WORKER")" --as=$((size * 1024 + 20000000))
	job
	says w1 event=world_failed
	worker w0
	finish_job
	kill -0 "$WORKER" || fail "$NAME: the small worker is gone"
	"$BIN/hslt-job" log "$ID" | grep -q 'event=lease_failed worker="w1" .*memory' || fail "$NAME: the log does not say why"
	BOX=$small
	QUIET=$quiet
}

fault clock_jumps 6 2 "all wall clocks jump by a year, back and forth"
clock_jumps() {
	${CC:-cc} -shared -fPIC -O1 -o "$DIR/clock.so" "$HERE/faults/clock.c" 2>"$DIR/cc.log" || fail "$NAME: no compiler: $(cat "$DIR/cc.log")"
	export HSLT_CLOCK="$DIR/clock" LD_PRELOAD="$DIR/clock.so"
	farm
	worker w0
	worker w1
	unset LD_PRELOAD
	job
	each_time clock_jumps_once
	finish_job
	unset HSLT_CLOCK
	[ "$(cut -c6-9 "$DIR/coordinator.log" | sort -u | wc -l)" -gt 1 ] || fail "$NAME: no clock jumped"
	blameless
}
clock_jumps_once() {
	echo $(((i % 3 - 1) * 31622400)) >"$DIR/clock.new"
	mv "$DIR/clock.new" "$DIR/clock"
}
