# SPDX-License-Identifier: Apache-2.0
# Faults of the disk: the tests in tests/coordinator/power_loss, where the coordinator's calls go through a disk that
# loses what was not synchronised. These tests count acknowledged results that are missing, results that a film contains
# twice, and images with other bits.

fault power 101 0 "power is lost at any of the coordinator's disk operations"
power() {
	disk_test power $((TIMES - 1)) 100000
}

fault failing_calls 1 0 "one of the coordinator's disk operations fails: EIO, ENOSPC, EMFILE, EROFS"
failing_calls() {
	disk_test "failing calls" 1 72
}

fault failing_starts 1 0 "a disk operation fails while the coordinator starts with unfinished jobs"
failing_starts() {
	disk_test "failing starts" 1 20
}

# disk_test WHAT SEEDS STEP: sets TIMES to the number of such events that the test reports
disk_test() {
	[ -x "$BUILD/tests/coordinator/power_loss/test_durability" ] || fail "$NAME: tests/coordinator/power_loss/test_durability is not built"
	HSLT_POWER_SEEDS=$2 HSLT_FAULT_STEP=$3 "$BUILD/tests/coordinator/power_loss/test_durability" >"$DIR/power.log" 2>&1 && CODE=0 || CODE=$?
	# shellcheck disable=SC2046
	set -- $(sed -n "s/^ *$1: times=\([0-9]*\) lost=\([0-9]*\) doubled=\([0-9]*\) images=\([0-9]*\) unequal=\([0-9]*\)$/\1 \2 \3 \4 \5/p" "$DIR/power.log")
	[ $# -eq 5 ] && [ "$1" -gt 0 ] && [ "$4" -gt 0 ] || fail "$NAME: it counts nothing: $(tail -n 9 "$DIR/power.log")"
	TIMES=$1
	[ "$5" -eq 0 ] && equal=yes || equal=no
	[ $CODE -eq 0 ] || [ "$2 $3 $5" != "0 0 0" ] || fail "$NAME: test_durability ended with $CODE: $(tail -n 9 "$DIR/power.log")"
	row "$2" "$3" $equal -
}
