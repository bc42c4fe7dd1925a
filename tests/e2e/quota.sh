# SPDX-License-Identifier: Apache-2.0
# A quota of live jobs while the coordinator is killed among submissions and cancellations: there are never more jobs
# than it allows, and an ended job frees its place, even if nobody was told of the end.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-submit hslt-job

MOST=3
live() {
	"$BIN/hslt-job" list 2>/dev/null | grep -c '^j[0-9]* *\(bootstrap\|waiting\|running\|held\|queued\)' || :
}
one() {
	"$BIN/hslt-submit" "$BOX" -o "$DIR/no.exr" --integrator path --spp 4 >>"$DIR/ids" 2>>"$DIR/submit.log"
}
# kill_within SECONDS: kills the coordinator and starts it again on the same spool
kill_within() {
	sleep "$1"
	kill -9 $COORDINATOR_PID
	wait $COORDINATOR_PID 2>/dev/null || :
	LISTEN=$COORDINATOR start_coordinator --quota-jobs $MOST
}

start_coordinator --quota-jobs $MOST
: >"$DIR/ids"
for pause in 0.03 0.08 0.15; do
	submitters=
	for k in 1 2 3 4 5; do
		one &
		submitters="$submitters $!"
	done
	kill_within $pause
	for p in $submitters; do
		wait "$p" || :
	done
	[ "$(live)" -le $MOST ] || fail "$(live) jobs live, where $MOST may: $("$BIN/hslt-job" list)"
	# The remaining quota can be used, and no more.
	left=$((MOST - $(live)))
	while [ $left -gt 0 ]; do
		one || fail "refused with $(live) live jobs: $(tail -n 1 "$DIR/submit.log")"
		left=$((left - 1))
	done
	[ "$(live)" = $MOST ] || fail "$(live) jobs live, not $MOST: $("$BIN/hslt-job" list)"
	code 6 "$BIN/hslt-submit" "$BOX" -o "$DIR/no.exr" --integrator path --spp 4
	grep -q "quota: at most $MOST live jobs" "$DIR/err.log" || fail "not refused by the quota: $(cat "$DIR/err.log")"
	# A client that was told that its job was accepted finds the job.
	while read -r id; do
		"$BIN/hslt-job" list | grep -q "^$id " || fail "$id is gone"
	done <"$DIR/ids"
	(
		for id in $("$BIN/hslt-job" list | sed -n 's/^\(j[0-9]*\) .*/\1/p'); do
			"$BIN/hslt-job" cancel "$id" || :
		done
	) >/dev/null 2>&1 &
	cancels=$!
	kill_within $pause
	wait $cancels || :
	for id in $("$BIN/hslt-job" list | sed -n 's/^\(j[0-9]*\) .*/\1/p'); do
		"$BIN/hslt-job" cancel "$id" >/dev/null 2>&1 || :
	done
	[ "$(live)" = 0 ] || fail "$(live) jobs live that were cancelled: $("$BIN/hslt-job" list)"
done
echo "never more than $MOST live jobs, $(wc -l <"$DIR/ids") taken, among six kills"
