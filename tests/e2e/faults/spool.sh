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
