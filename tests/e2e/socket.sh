# SPDX-License-Identifier: Apache-2.0
# The status socket's file: who may connect to it; and that a file of another owner at its path is never followed, taken
# over or removed.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-status
AT=$DIR/at

# refused SENTENCE OPTION...: a second coordinator with a status socket at $AT does not start
refused() {
	sentence=$1
	shift
	code=0
	timeout 100 "$BIN/hslt-coordinator" --listen 127.0.0.1:0 --spool "$DIR/other" --status-socket "$AT" "$@" 2>"$DIR/err.log" || code=$?
	[ $code -ne 0 ] && [ $code -ne 124 ] || fail "it starts, or hangs ($code), though: $sentence"
	grep -q -e "$sentence" "$DIR/err.log" || fail "it says: $(cat "$DIR/err.log")"
}

# begin OPTION...: starts a coordinator that must succeed
begin() {
	rm -f "$DIR/port"
	"$BIN/hslt-coordinator" --listen 127.0.0.1:0 --port-file "$DIR/port" --spool "$DIR/spool" --status-socket "$AT" "$@" \
		2>>"$DIR/coordinator.log" &
	COORDINATOR_PID=$!
	PIDS="$PIDS $COORDINATOR_PID"
	until_true 10 test -s "$DIR/port" || fail "it does not start"
}

answers() {
	"$BIN/hslt-status" --socket "$AT" --json >/dev/null
}

# A file that is not a socket stays as it is, and so does the target of a link.
echo precious >"$AT"
refused "not a socket"
[ "$(cat "$AT")" = precious ] || fail "a file was changed"
mv "$AT" "$DIR/target"
ln -s "$DIR/target" "$AT"
refused "not a socket"
ln -sfn "$DIR/nowhere" "$AT"
refused "not a socket"
[ -L "$AT" ] && [ ! -e "$DIR/nowhere" ] || fail "a link was followed or removed"
rm "$AT"
mkfifo "$AT"
refused "not a socket"
rm "$AT"
mkdir "$AT"
refused "not a socket"
rmdir "$AT"
AT=$DIR/$(printf '%0120d' 0)
refused "at most"
AT=$DIR/none/at
refused "No such file"
AT=$DIR/at
refused "no group 'nobody-of-that-name'" --status-group nobody-of-that-name
[ ! -e "$AT" ] || fail "a socket was left"
timeout 100 env -u HSLT_STATUS_SOCKET "$BIN/hslt-coordinator" --spool "$DIR/other" --status-group daemon 2>"$DIR/err.log" && fail "a group for no socket"

# A live socket of another process, also through a link; one that answers so slowly that its queue is full; one of
# another type.
begin
[ "$(stat -c %a "$AT")" = 600 ] || fail "the mode is $(stat -c %a "$AT")"
answers || fail "no answer"
refused "another program answers"
mv "$AT" "$DIR/moved"
ln -s "$DIR/moved" "$AT"
refused "not a socket"
rm "$AT"
mv "$DIR/moved" "$AT"
answers || fail "it was disturbed"
if "${PYTHON:-python3}" -c '' 2>/dev/null; then
	# The number of readers is limited: a further one is told so, and gets in when another one has gone.
	"${PYTHON:-python3}" -c '
import socket, sys, time
readers = [socket.socket(socket.AF_UNIX) for _ in range(64)]
for r in readers:
    r.connect(sys.argv[1])
for r in readers:
    r.recv(1)
open(sys.argv[1] + ".full", "w")
time.sleep(600)' "$AT" &
	crowd=$!
	PIDS="$PIDS $crowd"
	until_true 10 test -e "$AT.full" || fail "64 cannot read"
	code 75 "$BIN/hslt-status" --socket "$AT"
	grep -q "64 others are connected" "$DIR/err.log" || fail "it says: $(cat "$DIR/err.log")"
	kill $crowd
	wait $crowd 2>/dev/null || :
	# A reader that was told so and disconnected before it asked for changes once died of a signal, without a
	# message.
	"${PYTHON:-python3}" -c '
import socket, sys
s = socket.socket(socket.AF_UNIX)
s.bind(sys.argv[1] + ".deaf")
s.listen(200)
while True:
    c = s.accept()[0]
    c.sendall(b"{\"type\":\"error\",\"text\":\"not now\"}\n")
    c.close()' "$AT" &
	deaf=$!
	PIDS="$PIDS $deaf"
	until_true 10 test -S "$AT.deaf" || fail "nobody listens"
	for k in $(seq 100); do
		code 75 "$BIN/hslt-status" --socket "$AT.deaf" --watch
		grep -q "not now" "$DIR/err.log" || fail "it says: $(cat "$DIR/err.log")"
	done
	kill $deaf
	wait $deaf 2>/dev/null || :
	until_true 10 answers 2>"$DIR/err.log" || fail "no answer when they have gone"
	AT=$DIR/busy
	"${PYTHON:-python3}" -c '
import os, socket, sys, time
d, busy, kind = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM), socket.socket(socket.AF_UNIX), sys.argv[1]
busy.bind(kind + "/busy")
busy.listen(0)
socket.socket(socket.AF_UNIX).connect(kind + "/busy")
wait = [socket.socket(socket.AF_UNIX) for _ in range(3)]
for w in wait:
    w.setblocking(False)
    try:
        w.connect(kind + "/busy")
    except BlockingIOError:
        pass
d.bind(kind + "/kind")
time.sleep(600)' "$DIR" &
	PIDS="$PIDS $!"
	until_true 10 test -S "$DIR/kind" || fail "no sockets"
	refused "another program answers"
	AT=$DIR/kind
	refused "the socket of another user"
	AT=$DIR/at
fi

# A socket left by a killed coordinator is removed; one that another process has put there since is not.
kill -9 $COORDINATOR_PID
wait $COORDINATOR_PID 2>/dev/null || :
[ -S "$AT" ] || fail "it should be there still"
begin
answers || fail "a stale socket is in the way"
first=$COORDINATOR_PID
rm -f "$DIR/port"
kill -STOP $first # it would put its own there again
rm "$AT"
"$BIN/hslt-coordinator" --listen 127.0.0.1:0 --port-file "$DIR/port" --spool "$DIR/other" --status-socket "$AT" 2>>"$DIR/coordinator.log" &
second=$!
PIDS="$PIDS $second"
until_true 10 test -s "$DIR/port" || fail "the second does not start"
kill -CONT $first
until_true 10 grep -q 'event=status_socket .*another file' "$DIR/coordinator.log" || fail "the first does not say that nobody can ask it"
stop $first
answers || fail "the first removed the second's socket"
stop $second
[ ! -e "$AT" ] || fail "the socket stays"

# A socket file that is removed while the coordinator runs is created again, with its mode; connected readers stay
# connected, and the log says so once each time. The same holds if its folder is missing for a while.
mkdir "$DIR/run"
AT=$DIR/run/at
begin
"$BIN/hslt-status" --socket "$AT" --watch >"$DIR/watched" 2>&1 &
watcher=$!
PIDS="$PIDS $watcher"
until_true 10 test -s "$DIR/watched" || fail "nothing is watched"
for round in 1 2; do
	rm "$AT"
	until_true 10 answers 2>"$DIR/err.log" || fail "the socket is not made anew"
	[ "$(stat -c %a "$AT")" = 600 ] || fail "the mode of the new one is $(stat -c %a "$AT")"
	[ "$(grep -c 'event=status_socket .*made anew"' "$DIR/coordinator.log")" = $round ] || fail "not logged once in round $round"
done
kill -0 $watcher || fail "who watched was cut off: $(cat "$DIR/watched")"
mv "$DIR/run" "$DIR/gone"
until_true 10 grep -q 'event=status_socket .*cannot be made anew yet' "$DIR/coordinator.log" || fail "it is not said that the folder is gone"
mkdir "$DIR/run"
until_true 10 answers 2>"$DIR/err.log" || fail "the socket is not made anew in a new folder"
[ "$(grep -c 'event=status_socket .*cannot be made' "$DIR/coordinator.log")" = 1 ] || fail "the same is logged again and again"
kill $watcher
stop $COORDINATOR_PID
[ ! -e "$AT" ] || fail "the new socket stays"
AT=$DIR/at

# A group that may connect.
if [ "$(id -u)" = 0 ] && command -v setpriv >/dev/null && id daemon >/dev/null 2>&1; then
	begin --status-group daemon
	[ "$(stat -c '%a %G' "$AT")" = "660 daemon" ] || fail "it is $(stat -c '%a %G' "$AT")"
	cat >"$DIR/knock" <<'TEXT'
import socket, sys
socket.socket(socket.AF_UNIX).connect(sys.argv[1])
TEXT
	chmod 711 "$DIR"
	chmod 644 "$DIR/knock"
	knock() {
		setpriv --reuid 65534 --clear-groups "$@" /usr/bin/python3 "$DIR/knock" "$AT" 2>/dev/null
	}
	if [ -x /usr/bin/python3 ]; then
		knock --regid daemon || fail "the group cannot connect"
		knock --regid 65534 && fail "everybody can connect"
	fi
	stop $COORDINATOR_PID
	[ $CODE -eq 0 ] || fail "it ended with $CODE"
else
	echo "the group was not tried: not root"
fi
echo "status socket: nobody's file was touched, stale ones go, a group gets in"
