# SPDX-License-Identifier: Apache-2.0
# Faults of files in the spool: flipped bits, missing files.

# flip FILE SHARE: flips one bit at this share of the file's length
flip() {
	"$PYTHON" - "$1" "$2" <<'TEXT' || fail "$NAME: no bit of $1"
import os, sys
path, share = sys.argv[1], float(sys.argv[2])
at = int(os.path.getsize(path) * share)
with open(path, "r+b") as f:
	f.seek(at)
	byte = f.read(1)[0]
	f.seek(at)
	f.write(bytes([byte ^ 1 << at % 8]))
TEXT
}

# flip_result JOURNAL SHARE: flips one bit in the body of the first result (a record of kind 1 or 5; JOURNAL_RECORD_HEAD_SIZE in
# coordinator/store/journal_file.h) from this share of the journal on, and prints "result"; if there is none, flips one
# bit anywhere
flip_result() {
	"$PYTHON" - "$1" "$2" <<'TEXT' || fail "$NAME: no bit of $1"
import struct, sys
path, share = sys.argv[1], float(sys.argv[2])
with open(path, "r+b") as f:
	data = f.read()
	at = int(len(data) * share)
	record = data.find(b"\xf1hj\x0d", at)
	while 0 <= record <= len(data) - 80:
		size, _, kind = struct.unpack_from("<III", data, record + 4)
		if kind in (1, 5) and record + 80 + size <= len(data):
			at = record + 80 + size // 2
			print("result")
			break
		record = data.find(b"\xf1hj\x0d", record + 1)
	f.seek(at)
	f.write(bytes([data[at] ^ 1 << at % 8]))
TEXT
}

# finish_damaged COUNT: so many results were damaged on purpose and are computed again; the row does not count these
finish_damaged() {
	DAMAGED=$1
	finish_job
	DAMAGED=0
}

fault journal_bit 6 1 "one bit of a journal is wrong when the coordinator starts: that result alone is computed again"
journal_bit() {
	farm
	worker w0
	worker w1
	job
	each_time journal_is_damaged
	finish_damaged "$TIMES"
	# The first damaged result is named; a later one may have been taken back before, and is no longer needed.
	! grep -q result "$DIR/flipped" || grep -q 'level=error event=spool_fault .*the journal is damaged: .* computed again: [br]' "$DIR/coordinator.log" ||
		fail "$NAME: it does not say what is lost"
	# Whether a result after the damaged one must wait for it depends on where the journal was cut: of several, one
	# does.
	[ "$TIMES" -lt 3 ] || grep -q 'batch_merged .*late=1' "$DIR/coordinator.log" || fail "$NAME: nothing waited for what was damaged"
	blameless
}
# On hold, because an ended job has no journal.
journal_is_damaged() {
	hold_job
	kill -9 "$COORDINATOR_PID"
	wait "$COORDINATOR_PID" 2>/dev/null || :
	for journal in "$DIR/spool/jobs/$ID"/journal.*; do # two while a new one is being made: either may be the valid one
		flip_result "$journal" "0.$((20 + 10 * i))" >>"$DIR/flipped"
	done
	again
	release_job
}

fault clock_ahead 3 1 "the wall clock is 40 days ahead for a while, with a restart of the coordinator: results are kept"
clock_ahead() {
	${CC:-cc} -shared -fPIC -O1 -o "$DIR/clock.so" "$HERE/faults/clock.c" 2>"$DIR/cc.log" || fail "$NAME: no compiler: $(cat "$DIR/cc.log")"
	export HSLT_CLOCK="$DIR/clock" LD_PRELOAD="$DIR/clock.so"
	farm
	unset LD_PRELOAD
	worker w0
	worker w1
	small=$("$BIN/hslt-submit" "$BOX" -o "$DIR/small.exr" --integrator path --size 16x16 --spp 1 --wait 2>>"$DIR/submit.log") || fail "$NAME: no first job"
	job
	each_time clock_goes_ahead
	finish_job
	"$BIN/hslt-job" fetch "$small" -o "$DIR/later.exr" 2>>"$DIR/fetch.log" || fail "$NAME: $(tail -n 1 "$DIR/fetch.log")"
	"$BIN/hslt-compare" --exact "$DIR/small.exr" "$DIR/later.exr" >"$DIR/compare.log" || fail "$NAME: another first image"
	! grep -q 'event=job_cleared' "$DIR/coordinator.log" || fail "$NAME: $(grep 'event=job_cleared' "$DIR/coordinator.log")"
	unset HSLT_CLOCK
}
# The clock jumps 40 days and 4 s ahead, a job ends (which makes the coordinator look at the ages), the coordinator
# restarts, and all is as before.
clock_goes_ahead() {
	echo 3456004 >"$DIR/clock"
	"$BIN/hslt-submit" "$BOX" -o "$DIR/small$i.exr" --integrator path --size 16x16 --spp 1 --wait 2>>"$DIR/submit.log" >"$DIR/small.id" || fail "$NAME: no job"
	sleep 2.5
	kill -9 "$COORDINATOR_PID"
	export LD_PRELOAD="$DIR/clock.so"
	again
	unset LD_PRELOAD
	sleep 0.5
	echo 0 >"$DIR/clock"
}

fault jobs_database 8 2 "jobs.db, jobs-copy.db or a WAL is missing, truncated, or has a wrong bit when the coordinator starts"
jobs_database() {
	farm
	worker w0
	worker w1
	job
	each_time database_is_damaged
	finish_job
	[ "$(grep -c 'level=error event=spool_fault' "$DIR/coordinator.log")" -gt 0 ] || fail "$NAME: it does not say what was lost"
}
# On hold, so that the job does not end.
database_is_damaged() {
	hold_job
	kill -9 "$COORDINATOR_PID"
	wait "$COORDINATOR_PID" 2>/dev/null || :
	db=$DIR/spool/jobs$([ "$i" -le 4 ] || echo -copy).db
	[ -s "$db-wal" ] || : >>"$db-wal"
	case $((i % 4)) in
	1) rm "$db-wal" ;;
	2) flip "$db" 0.4 ;;
	3) rm "$db" "$db-wal" ;;
	0) truncate -s 3000 "$db" ;;
	esac
	again
	[ -d "$DIR/spool/jobs/$ID" ] || fail "$NAME: the job's folder is gone"
	release_job
}

fault plan_changed 2 1 "a number in the plan in a job's row has changed when the coordinator starts"
plan_changed() {
	farm
	worker w0
	worker w1
	job
	each_time plan_is_changed
	finish_job
	[ "$(grep -c 'its row in jobs.db was damaged: restored from jobs-copy.db' "$DIR/coordinator.log")" -eq "$TIMES" ] || fail "$NAME: not noticed"
}
# On hold, so that the job does not end.
plan_is_changed() {
	hold_job
	kill -9 "$COORDINATOR_PID"
	wait "$COORDINATOR_PID" 2>/dev/null || :
	"$PYTHON" - "$DIR/spool/jobs.db" <<'TEXT' || fail "$NAME: no row"
import sqlite3, sys
db = sqlite3.connect(sys.argv[1])
(plan,) = db.execute("SELECT plan FROM jobs WHERE ended IS NULL").fetchone()
db.execute("UPDATE jobs SET plan = ? WHERE ended IS NULL", (plan[:-1] + bytes([plan[-1] ^ 1]),))
db.commit()
TEXT
	again
	release_job
}

fault row_lost 1 1 "a job's row is missing in jobs.db and in jobs-copy.db: the coordinator starts only with --accept-loss"
row_lost() {
	farm
	worker w0
	worker w1
	job
	until_true 60 is_merged 3 || fail "$NAME: nothing is merged"
	hold_job
	other=$ID
	job
	each_time row_is_lost
	finish_job
	[ -s "$DIR/spool/lost/$other/why" ] && [ -s "$DIR/spool/lost/$other/journal.0" ] || fail "$NAME: what was left of $other is gone"
}
row_is_lost() {
	kill -9 "$COORDINATOR_PID"
	wait "$COORDINATOR_PID" 2>/dev/null || :
	"$PYTHON" - "$DIR/spool" "${other#j}" <<'TEXT' || fail "$NAME: no row"
import sqlite3, sys
for name in "jobs.db", "jobs-copy.db":
    db = sqlite3.connect(sys.argv[1] + "/" + name)
    db.execute("DELETE FROM jobs WHERE id = ?", (int(sys.argv[2]),))
    db.commit()
TEXT
	"$BIN/hslt-coordinator" --listen "$COORDINATOR" --spool "$DIR/spool" >"$DIR/refused.out" 2>"$DIR/refused.log" && fail "$NAME: it starts"
	grep -q "has lost 1 job: $other .*--accept-loss" "$DIR/refused.log" || fail "$NAME: it says: $(tail -n 1 "$DIR/refused.log")"
	[ -s "$DIR/spool/jobs/$other/journal.0" ] || fail "$NAME: refused, and deleted"
	again --accept-loss
}

fault folder_gone 6 2 "a job's folder is removed, moved away, or removed twice while the job runs"
folder_gone() {
	farm # the second start makes a new journal from that of the first; in the second run there are checkpoints
	worker w0
	worker w1
	job
	i=0
	while [ $i -lt "$TIMES" ]; do # in the first half of the job: once the job had ended, its image would be lost with the folder
		i=$((i + 1))
		until_true 60 is_merged $((RESULTS * i / (2 * TIMES))) || fail "$NAME: $(merged) of $RESULTS results at time $i"
		folder_goes
	done
	finish_job
	blameless
}
# The job is held meanwhile, so that it does not end before the loss is noticed.
folder_goes() {
	hold_job
	seen=$(times_noticed)
	case $((i % 3)) in
	1) mv "$DIR/spool/jobs/$ID" "$DIR/moved.$i" ;;
	2) remove_folder && until_true 30 is_noticed && seen=$(times_noticed) && remove_folder ;;
	0) remove_folder ;;
	esac
	until_true 30 is_noticed || fail "$NAME: it does not notice"
	until_true 30 is_mended || fail "$NAME: it is not mended: $(tail -n 3 "$DIR/coordinator.log")"
	[ "$i" -ne 2 ] || { kill -9 "$COORDINATOR_PID" && again --journal 0.2; } # everything is in the new folder
	release_job
}
# The coordinator may put a file into the folder while rm walks through it.
remove_folder() {
	rm -r "$DIR/spool/jobs/$ID" 2>/dev/null || rm -rf "$DIR/spool/jobs/$ID" 2>/dev/null || :
}
times_noticed() {
	grep -c 'was removed or moved away while the job runs: restored' "$DIR/coordinator.log" || :
}
is_noticed() {
	[ "$(times_noticed)" -gt "$seen" ]
}
# its results can be stored again since the folder was restored
is_mended() {
	grep 'being restored\|state=released text=""' "$DIR/coordinator.log" | tail -n 1 | grep -q state=released
}

fault file_damaged 4 1 "a file of the scene is damaged in the spool and in a worker's cache: the job waits and says so until the scene is sent again"
file_damaged() {
	farm
	start_worker w0 -v --cache "$DIR/own"
	job
	until_true 60 is_merged 3 || fail "$NAME: nothing is merged"
	each_time file_is_damaged
	finish_job
	blameless
}
# The job is held meanwhile, so that the worker does not end it before it is put on hold.
file_is_damaged() {
	hold_job
	for f in "$DIR/spool/blobs"/[0-9a-f]*; do
		flip "$f" 0.5
	done
	stop "$WORKER"
	for f in "$DIR/own"/*/[0-9a-f]*; do
		[ ! -f "$f" ] || flip "$f" 0.5
	done
	[ $((i % 2)) -eq 0 ] || { kill -9 "$COORDINATOR_PID" && again; }
	sleep 0.1
	start_worker "w$i" -v --cache "$DIR/own"
	release_job
	until_true 60 waits_for_file || fail "$NAME: it does not wait: $(value "$ID" waiting)"
	# shellcheck disable=SC2086
	again_id=$("$BIN/hslt-submit" "$BOX" -o "$DIR/again.exr" $JOB 2>>"$DIR/submit.log") || fail "$NAME: $(tail -n 1 "$DIR/submit.log")"
	"$BIN/hslt-job" cancel "$again_id" 2>>"$DIR/cancel.log"
}
waits_for_file() {
	value "$ID" waiting | grep -q 'is damaged or missing in the spool: submit the scene again'
}
