# SPDX-License-Identifier: Apache-2.0
# deploy/workers.sh starts workers over ssh; in this test ssh is a shell on this machine.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-status

cat >"$DIR/ssh" <<'TEXT'
#!/bin/sh
# ssh HOST COMMAND, without a network
shift
exec sh -c "$1"
TEXT
chmod +x "$DIR/ssh"
export HOME="$DIR" SSH="$DIR/ssh"
start_coordinator
HERE_ABSOLUTE=$(cd "$BIN" && pwd)
PID_FILE=$DIR/.hslt-worker.$(hostname).pid
start() {
	sh "$HERE/../../deploy/workers.sh" --threads 1 --path "$HERE_ABSOLUTE/hslt-worker" --log "$DIR/it's a.log" node1
}
stop_there() {
	sh "$HERE/../../deploy/workers.sh" --stop node1
}
# Files of another host with the same home, and of this host before a reboot: the recorded process id now belongs to
# another process.
sleep 600 &
SLEEPER=$!
PIDS="$PIDS $SLEEPER"
echo $SLEEPER >"$PID_FILE"
echo $SLEEPER >"$DIR/.hslt-worker.elsewhere.pid"
code 1 stop_there
kill -0 $SLEEPER || fail "somebody else's process was ended"
echo $SLEEPER >"$PID_FILE"
code 0 start
PIDS="$PIDS $(cat "$PID_FILE")"
grep -q '^started$' "$DIR/out" || fail "$(cat "$DIR/out")"
until_true 5 sh -c "'$BIN/hslt-status' --json | grep -q '\"threads\":1'" || fail "no worker came"
code 1 start
grep -q -- '--stop first' "$DIR/err.log" || fail "a second worker: $(cat "$DIR/err.log")"
code 0 stop_there
grep -q '^stopped$' "$DIR/out" || fail "$(cat "$DIR/out")"
until_true 5 sh -c "'$BIN/hslt-status' --json | grep -q '\"workers\":\[\]'" || fail "the worker stays"
[ "$(cat "$DIR/.hslt-worker.elsewhere.pid")" = $SLEEPER ] || fail "another host's file is gone"
sh "$HERE/../../deploy/workers.sh" --path /none node1 >"$DIR/out" 2>&1 && fail "a program that is not there was started"
sh "$HERE/../../deploy/workers.sh" --dry-run --tls "a b" node1 | grep -q -e "--tls 'a b'" || fail "--tls is not handed on"
sh "$HERE/../../deploy/workers.sh" --dry-run node1 node2 | grep -c '^node' | grep -q '^2$' || fail "dry run"
echo "workers started and stopped over ssh"
