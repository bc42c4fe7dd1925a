# SPDX-License-Identifier: Apache-2.0
# Too little memory (ulimit -v, RLIMIT_AS) makes a worker exit with a message, or return the leases of a job: no signal
# ends its process, and no job fails because of it.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit
nm "$BIN/hslt-worker" 2>/dev/null | grep -q '__asan_init\|__tsan_init' && skip "sanitizers need terabytes of addresses"

# limited KILOBYTES NAME: a worker with that limit, which exits when there is no work
limited() {
	(
		ulimit -v "$1"
		exec timeout 60 "$BIN/hslt-worker" --threads 2 --name "$2" --cache "$DIR/cache-$2" --idle-exit 0.3 --grace 1
	) >"$DIR/limited.log" 2>&1
}

start_coordinator
id=$(submit "$BOX" -o "$DIR/box.exr" --integrator path --spp 1 --size 16x12)
refused=0 kept=0
# From too little for the program's libraries to enough for connecting; only the range in between is of interest.
for kb in 84000 92000 100000 108000 112000 116000 120000 124000 130000 140000; do
	code=0
	limited $kb "w$kb" || code=$?
	! grep -q 'process_lost\|SIG' "$DIR/limited.log" || fail "$kb kB: $(cat "$DIR/limited.log")"
	case $code in
	1)
		! grep -q 'no memory\|annot allocate memory' "$DIR/limited.log" || refused=$((refused + 1))
		;;
	0)
		! grep -q 'event=lease_failed.*memory' "$DIR/limited.log" || kept=$((kept + 1))
		;;
	127) ;;
	*) fail "$kb kB: it ended with $code: $(cat "$DIR/limited.log")" ;;
	esac
done
[ $refused -gt 0 ] || fail "no worker said that it has too little memory to start"
[ $kept -ge 3 ] || fail "$kept workers had too little memory for the scene alone, which cannot fail the job"
! is_state "$id" failed || fail "$id failed: $(value "$id" why)"
grep -q "event=lease_failed job=$id .*own=1 .*memory" "$DIR/coordinator.log" || fail "the coordinator does not know that memory was short"

start_worker w
until_true 60 is_state "$id" done || fail "$id is $(value "$id" state)"
echo "$refused workers were too small to start, $kept for the scene; the job is done all the same"
