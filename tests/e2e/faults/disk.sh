# Faults of the disk: those of tests/coordinator/power, where the coordinator's calls go through a disk that loses what was not
# synchronised. Its own count: what was acknowledged is there after each loss, and the image has the same bits.

fault power 101 0 "the power goes at any call of the coordinator's disk"
power() {
	disk_test $((TIMES - 1)) 100000
	grep -q "^ *$TIMES runs .* none lost" "$DIR/power.log" || fail "$NAME: $(tail -n 3 "$DIR/power.log")"
	row 0 0 yes
}

fault failing_calls 32 0 "a call of the coordinator's disk fails: EIO, ENOSPC, EMFILE, EROFS"
failing_calls() {
	disk_test 1 72
	TIMES=$(awk '/^ *E[A-Z]* at [0-9]* of/ { n += $3 } END { print n + 0 }' "$DIR/power.log")
	[ "$TIMES" -gt 0 ] || fail "$NAME: no call failed"
	row 0 0 yes
}

# disk_test SEEDS STEP
disk_test() {
	[ -x "$BUILD/tests/coordinator/power/test_power" ] || fail "$NAME: tests/coordinator/power/test_power is not built"
	HSLT_POWER_SEEDS=$1 HSLT_FAULT_STEP=$2 "$BUILD/tests/coordinator/power/test_power" >"$DIR/power.log" 2>&1 || fail "$NAME: test_power"
}
