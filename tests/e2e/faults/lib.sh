# SPDX-License-Identifier: Apache-2.0
# What the faults have in common: a farm of their own each, a job that runs meanwhile, moments, and the count at the end.
# A fault is a function of the same name:
#   fault NAME TIMES SHORT "what the table says"
# TIMES is how often `make test-faults` injects it, SHORT how often the tests of every day do (0: not then).

FAULTS=
DAMAGED=0 # results that were damaged on purpose
ROWS=$TOP/rows
SKIPPED=$TOP/skipped
: >"$ROWS"
: >"$SKIPPED"

fault() {
	FAULTS="$FAULTS $1"
	eval "times_$1=$2 short_$1=$3 text_$1=\$4"
}

# begin NAME: a folder of its own
begin() {
	NAME=$1
	DIR=$TOP/$NAME
	COUNTED= # results of other films do not tell
	mkdir "$DIR"
	PIDS=
	export HSLT_STATUS_SOCKET="$DIR/status"
}

# farm [OPTION...]: a coordinator that tells all, and is quick to miss a worker
farm() {
	start_coordinator -v --heartbeat 0.2 "$@"
}

worker() {
	start_worker "$@" -v
}

faulty_worker() {
	start_faulty_worker "$@" -v
}

# again [OPTION...]: the coordinator, at the same place, from the same spool
again() {
	wait "$COORDINATOR_PID" 2>/dev/null || :
	LISTEN=$COORDINATOR farm "$@"
}

# job [OPTION...]: its id is in ID
job() {
	# shellcheck disable=SC2086
	ID=$(submit "$BOX" -o "$DIR/image.exr" $JOB "$@") || fail "$NAME: $(tail -n 1 "$DIR/submit.log")"
}

# what the coordinator has merged in all its runs
merged() {
	grep -c "event=batch_merged job=$ID " "$DIR/coordinator.log" || :
}

is_merged() {
	[ "$(merged)" -ge "$1" ]
}

# moment I: the I-th of TIMES, spread over the job
moment() {
	until_true 60 is_merged $((RESULTS * $1 / (TIMES + 1))) || fail "$NAME: $(merged) of $RESULTS results at time $1"
}

# each_time COMMAND...: TIMES times, while the job runs. The job takes less than a second, and goes on when this script stands still: a
# COMMAND that finds it ended sets LATE, and is called again while another job runs.
each_time() {
	i=0
	attempts=0
	while [ $i -lt "$TIMES" ]; do
		i=$((i + 1))
		moment $i
		LATE=
		"$@"
		[ -n "$LATE" ] || continue
		attempts=$((attempts + 1))
		[ $attempts -lt 9 ] || fail "$NAME: nine jobs ended too early"
		i=$((i - 1))
		job
	done
}

# hold_job [FROM [MOST]]: the job is held when it has FROM results, and at most MOST, so that enough of it is left when it is released;
# another one if this one has more, or has ended
hold_job() {
	attempts=0
	until "$BIN/hslt-job" hold "$ID" 2>>"$DIR/hold.log" && ! is_merged $((${2:-$((RESULTS - 32))} + 1)); do
		attempts=$((attempts + 1))
		[ $attempts -lt 9 ] || fail "$NAME: cannot be held: $(tail -n 1 "$DIR/hold.log")"
		is_state "$ID" done || "$BIN/hslt-job" cancel "$ID" 2>>"$DIR/hold.log" || :
		job
		until_true 60 is_merged "${1:-3}" || fail "$NAME: only $(merged) results"
	done
}

# Results that were under way may have ended it.
release_job() {
	"$BIN/hslt-job" release "$ID" 2>>"$DIR/hold.log" || is_state "$ID" done || fail "$NAME: $(tail -n 1 "$DIR/hold.log")"
}

# Workers, by their process ids, that stand still until they go on, lest they do what another one is to do.
stand_still() {
	for p in "$@"; do
		kill -STOP "$(renders "$p")"
	done
}
go_on() {
	for p in "$@"; do
		kill -CONT "$(renders "$p")"
	done
}

# says LOG TEXT [SECONDS]: until it does
says() {
	until_true "${3:-30}" grep -qs -e "$2" "$DIR/$1.log" || fail "$NAME: $1 never says: $2"
}

# times_said LOG TEXT
times_said() {
	grep -cs -e "$2" "$DIR/$1.log" || :
}

# has_said LOG TEXT TIMES
has_said() {
	[ "$(times_said "$1" "$2")" -ge "$3" ]
}

# the job ends, its image is compared, its results are counted
finish_job() {
	until_true 120 is_state "$ID" done || fail "$NAME: $ID is $(value "$ID" state): $(value "$ID" waiting)"
	[ -s "$DIR/image.exr" ] || "$BIN/hslt-job" fetch "$ID" -o "$DIR/image.exr" 2>>"$DIR/fetch.log" || fail "$NAME: no image"
	sleep 0.1 # the last word to a worker
	equal=yes
	"$BIN/hslt-compare" --exact "$QUIET" "$DIR/image.exr" >"$DIR/compare.log" 2>&1 || equal=no
	# shellcheck disable=SC2046
	set -- $(cat "$DIR/coordinator.log" "$DIR"/[wh]*.log | awk -v job="$ID" -f "$HERE/faults/count.awk")
	[ "$3" -eq "$RESULTS" ] || fail "$NAME: the film holds $3 results, not $RESULTS"
	row $(($1 > DAMAGED ? $1 - DAMAGED : 0)) "$2" $equal "$4"
}

# row LOST DOUBLED EQUAL AGAIN
row() {
	eval "text=\$text_$NAME"
	printf '%s|%s|%s|%s|%s|%s\n' "$text" "$TIMES" "$1" "$2" "$3" "$4" >>"$ROWS"
	printf '%-74s %5s %5s %8s  %-10s  %s\n' "$text" "$TIMES" "$1" "$2" "$3" "$4"
}

# The fault cannot be injected here: no row.
cannot() {
	echo "$NAME: $*" >>"$SKIPPED"
	skip_part "$NAME: $*"
}

end() {
	for p in $PIDS; do
		kill -9 "$p" 2>/dev/null || :
	done
	wait 2>/dev/null || :
	if grep -l 'runtime error:\|ERROR: .*Sanitizer\|Assertion' "$DIR"/*.log; then
		fail "$NAME: a program failed"
	fi
	[ ! -d "$DIR/spool" ] || umount "$DIR/spool" 2>/dev/null || :
	PIDS=
	unset LISTEN
}
