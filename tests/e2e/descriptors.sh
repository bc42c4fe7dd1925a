# SPDX-License-Identifier: Apache-2.0
# Programs started with closed standard descriptors never write messages into another file; an unread log blocks
# nothing.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-job

# nothing PID: checks that the standard descriptors of that process lead nowhere
nothing() {
	for fd in 0 1 2; do
		[ "$(readlink "/proc/$1/fd/$fd")" = /dev/null ] || fail "descriptor $fd of process $1 is $(readlink "/proc/$1/fd/$fd")"
	done
}

JOB="--integrator path --size 32x32 --epoch 1"

# ---- closed descriptors
"$BIN/hslt-coordinator" -v --listen 127.0.0.1:0 --port-file "$DIR/port" --spool "$DIR/spool" --status-socket "$DIR/status" \
	0<&- 1>&- 2>&- &
listens
nothing "$COORDINATOR_PID"
"$BIN/hslt-worker" -v --threads 1 --cache "$DIR/cache" 0<&- 1>&- 2>&- &
WORKER=$!
PIDS="$PIDS $WORKER"
nothing "$(renders $WORKER)"
id=$(submit "$BOX" -o "$DIR/a.exr" $JOB --spp 64)
until_true 60 is_state "$id" done || fail "$id is $(value "$id" state)"
"$BIN/hslt-job" fetch "$id" -o "$DIR/a.exr" 2>/dev/null || fail "no image"
"$BIN/hslt-job" fetch "$id" -o "$DIR/b.exr" 0<&- 1>&- 2>&- || fail "no image without stderr"
cmp "$DIR/a.exr" "$DIR/b.exr" || fail "a message is in the image"
code 1 sh -c "\"$BIN/hslt-job\" list 1>&-"
stop $WORKER
[ "$CODE" -eq 0 ] || fail "the worker ended with $CODE"
stop "$COORDINATOR_PID"
[ "$CODE" -eq 0 ] || fail "the coordinator ended with $CODE"

# ---- a log that nobody reads: its pipe is full (64 KB) before the job is done
rm "$DIR/port"
mkfifo "$DIR/pipe"
sleep 100000 <"$DIR/pipe" &
READER=$!
PIDS="$PIDS $READER"
"$BIN/hslt-coordinator" -v --listen 127.0.0.1:0 --port-file "$DIR/port" --spool "$DIR/spool" --status-socket "$DIR/status" \
	2>"$DIR/pipe" &
listens
start_worker w
id=$(submit "$BOX" -o "$DIR/c.exr" $JOB --spp 512)
until_true 60 is_state "$id" done || fail "the farm waits for a reader of its log: $id is $(value "$id" state)"
cat "$DIR/pipe" >"$DIR/coordinator.log" &
PIDS="$PIDS $!"
says_dropped() {
	submit "$BOX" -o "$DIR/d.exr" $JOB --spp 1 >/dev/null
	grep -q 'event=log_dropped more=[1-9]' "$DIR/coordinator.log"
}
until_true 10 says_dropped || fail "the log does not say that lines are missing"
echo "closed descriptors, and a log that nobody reads"
