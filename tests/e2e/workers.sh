# deploy/workers.sh starts workers over ssh; here ssh is a shell on this machine.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-status

cat >"$DIR/ssh" <<'TEXT'
#!/bin/sh
# ssh HOST COMMAND, without the network
shift
exec sh -c "$1"
TEXT
chmod +x "$DIR/ssh"
export HOME="$DIR" SSH="$DIR/ssh"
start_coordinator
HERE_ABSOLUTE=$(cd "$BIN" && pwd)
sh "$HERE/../../deploy/workers.sh" --threads 1 --path "$HERE_ABSOLUTE/hslt-worker" --log "$DIR/it's a.log" node1 >"$DIR/out"
PIDS="$PIDS $(cat "$DIR/.hslt-worker.pid")"
grep -q '^started$' "$DIR/out" || fail "$(cat "$DIR/out")"
until_true 5 sh -c "'$BIN/hslt-status' --json | grep -q '\"threads\":1'" || fail "no worker came"
sh "$HERE/../../deploy/workers.sh" --stop node1 >"$DIR/out"
grep -q '^stopped$' "$DIR/out" || fail "$(cat "$DIR/out")"
until_true 5 sh -c "'$BIN/hslt-status' --json | grep -q '\"workers\":\[\]'" || fail "the worker stays"
sh "$HERE/../../deploy/workers.sh" --path /none node1 >"$DIR/out" 2>&1 && fail "a program that is not there was started"
sh "$HERE/../../deploy/workers.sh" --dry-run --tls "a b" node1 | grep -q -e "--tls 'a b'" || fail "--tls is not handed on"
sh "$HERE/../../deploy/workers.sh" --dry-run node1 node2 | grep -c '^node' | grep -q '^2$' || fail "dry run"
echo "workers started and stopped over ssh"
