# Faults of what lies in the spool: bits that fall over, files that are gone.

# flip FILE SHARE: one bit, so far into the file
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

# finish_damaged COUNT: so many results were damaged and are computed again; those are not what the row counts
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
	[ "$(grep -c 'level=error event=spool_fault .*the journal is damaged: .* computed again: [br]' "$DIR/coordinator.log")" -ge $(((TIMES + 1) / 2)) ] ||
		fail "$NAME: it does not say what is lost"
	[ "$(grep -c 'batch_merged .*late=1' "$DIR/coordinator.log")" -gt 0 ] || fail "$NAME: nothing waited for what was damaged"
	blameless
}
journal_is_damaged() {
	kill -9 "$COORDINATOR_PID"
	wait "$COORDINATOR_PID" 2>/dev/null || :
	flip "$(ls "$DIR/spool/jobs/$ID"/journal.* | tail -n 1)" "0.$((20 + 10 * i))"
	again
}

fault clock_ahead 3 1 "the wall clock is 40 days ahead for a while, and the coordinator is started again meanwhile: results stay"
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
# 40 days and 4 s ahead, a job ends (which makes the coordinator look at the ages), it starts again, and all is as before
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
