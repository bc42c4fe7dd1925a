# SPDX-License-Identifier: Apache-2.0
# Output on a terminal: a bar that is redrawn only if the cursor can be moved, colours only where they are wanted; and
# the messages on Ctrl-C while waiting for a job.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-submit hslt-status hslt-job hslt-render hslt-ca
ESCAPE=$(printf '\033')

# on_terminal FILE COMMAND...: writes to FILE all output of the command on a terminal of its own
on_terminal() {
	file=$1
	shift
	python3 -c '
import os, pty, sys
with open(sys.argv[1], "wb") as out:
    def read(fd):
        data = os.read(fd, 65536)
        out.write(data)
        return b" "
    sys.stdout = open(os.devnull, "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    sys.exit(os.waitstatus_to_exitcode(pty.spawn(sys.argv[2:], read)))' "$file" "$@" </dev/null
}

# interrupted FILE WORDS COMMAND...: prints the exit code after Ctrl-C is pressed on the command's terminal, once the
# terminal has shown WORDS, a regular expression
interrupted() {
	file=$1
	shift
	python3 -c '
import os, pty, re, sys, time
pid, terminal = pty.fork()
if pid == 0:
    os.execv(sys.argv[3], sys.argv[3:])
shown, pressed, end = b"", False, time.monotonic() + 60
while time.monotonic() < end:
    try:
        data = os.read(terminal, 65536)
    except OSError:
        break
    if not data:
        break
    shown += data
    if not pressed and re.search(sys.argv[2].encode(), shown[-4096:]):
        os.write(terminal, b"\x03")
        pressed = True
with open(sys.argv[1], "wb") as out:
    out.write(shown)
code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) if pressed else 99
sys.exit(code if code >= 0 else 128 - code)' "$file" "$@" </dev/null
}

RENDER="$BIN/hslt-render $BOX --size 32x24 --integrator path --spp 4 --threads 1 -o $DIR/a.exr"
TERM=xterm on_terminal "$DIR/xterm" $RENDER || fail "hslt-render on a terminal: $(cat "$DIR/xterm")"
grep -q "$ESCAPE\[K" "$DIR/xterm" || fail "no bar on a terminal: $(cat -v "$DIR/xterm")"
TERM=dumb on_terminal "$DIR/dumb" $RENDER || fail "hslt-render on a dumb terminal: $(cat "$DIR/dumb")"
! grep -q "$ESCAPE" "$DIR/dumb" || fail "a dumb terminal gets escape sequences: $(cat -v "$DIR/dumb")"

# Ctrl-C in hslt-render, during rounds and during the bootstrap: the message says what is kept, and it is there.
code=0
interrupted "$DIR/rounds" 'running .* 0[.][1-9] %' "$BIN/hslt-render" "$BOX" --size 32x24 --integrator path --spp 100000 --epoch 1 --groups 4 --threads 1 \
	-o "$DIR/rounds.exr" || code=$?
[ $code -eq 1 ] && [ -s "$DIR/rounds.exr" ] && grep -q "interrupted: $DIR/rounds.exr holds [0-9]* complete round" "$DIR/rounds" ||
	fail "Ctrl-C while it renders: $code, $(cat -v "$DIR/rounds" | tail -c 400)"
set -- "$BIN/hslt-render" "$BOX" --size 32x24 --integrator pssmlt --bootstrap 2M --mutations 1000 --threads 1 -o "$DIR/start.exr"
code=0
interrupted "$DIR/start" 'bootstrap .* [0-9]*[2-9][.][0-9] %' "$@" || code=$?
[ $code -eq 1 ] && [ -s "$DIR/start.exr.bootstrap" ] && [ ! -e "$DIR/start.exr" ] && grep -q "interrupted.*bootstrap" "$DIR/start" ||
	fail "Ctrl-C during the bootstrap: $code, $(cat -v "$DIR/start" | tail -c 400)"
code=0
interrupted "$DIR/again" 'bootstrap .* [0-9]*[2-9][.][0-9] %' "$@" || code=$?
[ $code -eq 1 ] && [ -s "$DIR/start.exr.bootstrap" ] || fail "Ctrl-C after continuing: $code, $(cat -v "$DIR/again" | tail -c 400)"

# Before a lease of the bootstrap is finished there is nothing to keep; the message says so and names the option that
# would help, which then does.
for when in "1:scene built" "64:bootstrap .* ([1-9][0-9]*[.]|0[.][1-9])[0-9]* %"; do
	code=0 parts=${when%%:*}
	interrupted "$DIR/early" "${when#*:}" "$BIN/hslt-render" "$BOX" --size 32x24 --integrator pssmlt --bootstrap 4M --mutations 1000 \
		--parts $parts --threads 1 -o "$DIR/early.exr" || code=$?
	case $parts in
	1) words="interrupted.*nothing is kept: of the 16 leases of the bootstrap none was finished.*--parts" ;;
	64) words="interrupted.* of 1024 leases of the bootstrap are kept in $DIR/early.exr.bootstrap" ;;
	esac
	[ $code -eq 1 ] && [ ! -e "$DIR/early.exr" ] && tr -d '\r\n' <"$DIR/early" | grep -q "$words" ||
		fail "Ctrl-C at the beginning of the bootstrap, --parts $parts: $code, $(cat -v "$DIR/early" | tail -c 500)"
done

start_coordinator
"$BIN/hslt-submit" "$BOX" --size 32x24 --integrator path --spp 4 -o later.exr --wait 2>"$DIR/wait.log" >"$DIR/id" &
WAITS=$!
PIDS="$PIDS $WAITS"
until_true 60 test -s "$DIR/id" || fail "no job: $(cat "$DIR/wait.log")"
# Without a worker nothing else can end the wait. A shell makes background commands ignore SIGINT; SIGTERM is handled
# alike.
kill -TERM $WAITS
code=0
wait $WAITS || code=$?
[ $code -eq 143 ] || fail "it ends with $code: $(cat "$DIR/wait.log")"
for words in "the job continues" "hslt-job fetch j1 -o later.exr" "hslt-job cancel j1"; do
	grep -q "$words" "$DIR/wait.log" || fail "it does not say '$words': $(cat "$DIR/wait.log")"
done
"$BIN/hslt-job" list | grep -q '^j1 ' || fail "the job is gone"
code=0
interrupted "$DIR/wait" "j2\r" "$BIN/hslt-submit" "$BOX" --size 32x24 --integrator path --spp 4 -o later.exr --wait || code=$?
[ $code -eq 130 ] || fail "Ctrl-C ends hslt-submit with $code: $(cat "$DIR/wait")"
for words in "the job continues" "hslt-job fetch j2 -o later.exr" "hslt-job list" "hslt-job cancel j2"; do
	grep -q "$words" "$DIR/wait" || fail "after Ctrl-C it does not say '$words': $(cat "$DIR/wait")"
done
"$BIN/hslt-job" list | grep -q '^j2 ' || fail "Ctrl-C ended the job"

TERM=xterm on_terminal "$DIR/colors" "$BIN/hslt-status" --socket "$DIR/status" || fail "$(cat "$DIR/colors")"
grep -q "$ESCAPE\[" "$DIR/colors" || fail "no colours: $(cat -v "$DIR/colors")"
NO_COLOR=1 TERM=xterm on_terminal "$DIR/none" "$BIN/hslt-status" --socket "$DIR/status" || fail "$(cat "$DIR/none")"
! grep -q "$ESCAPE" "$DIR/none" || fail "colours with NO_COLOR: $(cat -v "$DIR/none")"

TERM=dumb on_terminal "$DIR/none" "$BIN/hslt-status" --socket "$DIR/status" || fail "$(cat "$DIR/none")"
! grep -q "$ESCAPE" "$DIR/none" || fail "a dumb terminal gets colours: $(cat -v "$DIR/none")"

"$BIN/hslt-ca" list --ca "$DIR/nothing" 2>"$DIR/ca.log" && fail "an authority that is not there has a list"
grep -q "hslt-ca init" "$DIR/ca.log" || fail "it does not say how to make one: $(cat "$DIR/ca.log")"
stop $COORDINATOR_PID
