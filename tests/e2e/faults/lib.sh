# SPDX-License-Identifier: Apache-2.0
# Shared by the faults: each has a farm of its own and a job that runs meanwhile, chooses moments during the job, and
# counts results at the end. A fault is a function of the same name:
#   fault NAME TIMES SHORT "the text in the table"
# TIMES is how often `make test-faults` injects it, SHORT how often the daily tests do (0: not at all).

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

# begin NAME: makes a folder for this fault
begin() {
	NAME=$1
	DIR=$TOP/$NAME
	COUNTED= # results of other films do not count
	mkdir "$DIR"
	PIDS=
	export HSLT_STATUS_SOCKET="$DIR/status"
}

# farm [OPTION...]: starts a coordinator with a full log that soon gives up silent workers
farm() {
	start_coordinator -v --heartbeat 0.2 "$@"
}

worker() {
	start_worker "$@" -v
}

faulty_worker() {
	start_faulty_worker "$@" -v
}

# again [OPTION...]: starts the coordinator again, at the same address, on the same spool
again() {
	wait "$COORDINATOR_PID" 2>/dev/null || :
	LISTEN=$COORDINATOR farm "$@"
}

# job [OPTION...]: submits the job; its id is in ID
job() {
	# shellcheck disable=SC2086
	ID=$(submit "$BOX" -o "$DIR/image.exr" $JOB "$@") || fail "$NAME: $(tail -n 1 "$DIR/submit.log")"
}

# prints the number of results that the coordinator has merged in all its runs
merged() {
	grep -c "event=batch_merged job=$ID " "$DIR/coordinator.log" || :
}

is_merged() {
	[ "$(merged)" -ge "$1" ]
}

# moment I: waits for the I-th of TIMES moments, spread over the job
moment() {
	until_true 60 is_merged $((RESULTS * $1 / (TIMES + 1))) || fail "$NAME: $(merged) of $RESULTS results at time $1"
}

# each_time COMMAND...: runs the command TIMES times while the job runs. The job takes less than a second, and continues
# while this script stands still: a COMMAND that finds the job ended sets LATE, and is called again with another job.
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

# hold_job [FROM [MOST]]: holds the job once it has FROM results and at most MOST, so that enough of it is left when it
# is released; takes another job if this one has more, or has ended
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

# Results that were under way may have ended the job.
release_job() {
	"$BIN/hslt-job" release "$ID" 2>>"$DIR/hold.log" || is_state "$ID" done || fail "$NAME: $(tail -n 1 "$DIR/hold.log")"
}

# Stops workers, given by process id, until they are continued, so that another worker gets the work.
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

# says LOG TEXT [SECONDS]: waits until the log contains the text
says() {
	until_true "${3:-30}" grep -qs -e "$2" "$DIR/$1.log" || fail "$NAME: $1 never says: $2"
}

# times_said LOG TEXT: prints how often the log contains the text
times_said() {
	grep -cs -e "$2" "$DIR/$1.log" || :
}

# has_said LOG TEXT TIMES: checks that the log contains the text so often
has_said() {
	[ "$(times_said "$1" "$2")" -ge "$3" ]
}

# waits until the job ends, compares its image and counts its results
finish_job() {
	until_true 120 is_state "$ID" done || fail "$NAME: $ID is $(value "$ID" state): $(value "$ID" waiting)"
	[ -s "$DIR/image.exr" ] || "$BIN/hslt-job" fetch "$ID" -o "$DIR/image.exr" 2>>"$DIR/fetch.log" || fail "$NAME: no image"
	sleep 0.1 # so that the worker gets its last message
	equal=yes
	"$BIN/hslt-compare" --exact "$QUIET" "$DIR/image.exr" >"$DIR/compare.log" 2>&1 || equal=no
	# shellcheck disable=SC2046
	set -- $(cat "$DIR/coordinator.log" "$DIR"/[wh]*.log | awk -v job="$ID" -f "$HERE/faults/count.awk")
	[ "$3" -eq "$RESULTS" ] || fail "$NAME: the film holds $3 results, not $RESULTS"
	row $(($1 > DAMAGED ? $1 - DAMAGED : 0)) "$2" $equal "$4"
}

# row LOST DOUBLED EQUAL AGAIN: writes the row of this fault
row() {
	eval "text=\$text_$NAME"
	printf '%s|%s|%s|%s|%s|%s\n' "$text" "$TIMES" "$1" "$2" "$3" "$4" >>"$ROWS"
	printf '%-74s %5s %5s %8s  %-10s  %s\n' "$text" "$TIMES" "$1" "$2" "$3" "$4"
}

# The fault cannot be injected on this machine: it gets no row.
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
