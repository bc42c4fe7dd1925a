# SPDX-License-Identifier: Apache-2.0
# Faults of the coordinator.

fault kill_coordinator 20 2 "the coordinator is killed (kill -9) and started again"
kill_coordinator() {
	farm
	worker w0
	worker w1
	job
	each_time coordinator_dies
	finish_job
}
coordinator_dies() {
	restores=$(times_restored)
	kill -9 "$COORDINATOR_PID"
	again "$@"
	is_restored || LATE=yes
}
times_restored() {
	times_said coordinator "event=job_state job=$ID state=restored"
}
# restored since `restores` was counted; otherwise the job had ended
is_restored() {
	[ "$(times_restored)" -gt "$restores" ]
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
# Not before there is a checkpoint: the disk may be slow.
coordinator_dies_early() {
	until_true 30 has_checkpoint_or_ended || fail "$NAME: no checkpoint is made"
	coordinator_dies --journal 0.05
}
has_checkpoint_or_ended() {
	grep -q "event=checkpoint job=$ID " "$DIR/coordinator.log" || is_state "$ID" done
}

fault leave_coordinator 10 1 "the coordinator gets SIGTERM and is started again"
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
	# shellcheck disable=SC2086
	"$BIN/hslt-submit" "$BOX" -o "$DIR/image.exr" $JOB --wait >"$DIR/id" 2>>"$DIR/wait.log" &
	waiting=$!
	PIDS="$PIDS $waiting"
	ID=j1
	until_true 60 test -s "$DIR/id" || fail "$NAME: no job: $(cat "$DIR/wait.log")"
	coordinator_dies # the first time before there is a worker; later ones may come after the image was fetched
	says wait 'trying again'
	worker w0
	first=$WORKER
	worker w1
	each_time patient_coordinator_dies
	wait $waiting || fail "$NAME: hslt-submit --wait ended with $?"
	[ -s "$DIR/image.exr" ] || fail "$NAME: no image"
	finish_job
	# The coordinator does not come back: hslt-submit says how to get the image, and the status that there is no
	# coordinator. Without workers the job cannot end before.
	stop "$first" "$WORKER"
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
# The job must also be fetched: hslt-submit waits for this job alone.
patient_coordinator_dies() {
	coordinator_dies
	LATE=
}

fault long_journal 3 1 "a journal takes long to read at a restart of the coordinator: it listens and reports its progress, peers wait"
long_journal() {
	${CC:-cc} -shared -fPIC -O1 -o "$DIR/slow.so" "$HERE/faults/slow.c" 2>"$DIR/cc.log" || fail "$NAME: no compiler: $(cat "$DIR/cc.log")"
	export HSLT_SLOW=20000
	farm
	worker w0
	worker w1
	job
	each_time journal_is_read_slowly
	finish_job
	unset HSLT_SLOW
	[ "$(grep -c 'is reading its jobs, [0-9]* %: requests wait' "$DIR"/w[01].log | awk -F: '{ n += $2 } END { print n }')" -ge "$TIMES" ] ||
		fail "$NAME: no worker called meanwhile"
	blameless
}
# Two jobs with different files, a list, and an order that is carried out once the journal has been read; the jobs are
# on hold, so that they do not end before.
journal_is_read_slowly() {
	hold_job
	kill -9 "$COORDINATOR_PID"
	wait "$COORDINATOR_PID" 2>/dev/null || :
	export LD_PRELOAD="$DIR/slow.so"
	LISTEN=$COORDINATOR listen -v --heartbeat 0.2
	unset LD_PRELOAD
	until_true 30 test -S "$DIR/status" || fail "$NAME: no status"
	share=$(share_read)
	[ -n "$share" ] || fail "$NAME: it does not say how far it is: $("$BIN/hslt-status" 2>&1)"
	"$BIN/hslt-job" list >"$DIR/list" 2>>"$DIR/list.log"
	grep -q "^$ID  *reading " "$DIR/list" || fail "$NAME: the list says: $(cat "$DIR/list")"
	until_true 30 is_further || fail "$NAME: it stays at $share %"
	release_job
	has_read || fail "$NAME: an order was carried out before the job was there"
}
share_read() {
	"$BIN/hslt-status" 2>/dev/null | sed -n "s/^$ID  *reading .*# reading, \([0-9]*\) %.*/\1/p"
}
is_further() {
	now=$(share_read)
	[ "$now" != "$share" ]
}
