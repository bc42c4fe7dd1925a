# SPDX-License-Identifier: Apache-2.0
# What a terminal gets: a bar that redraws itself only where the cursor can be moved, colours only where they are wanted; and what
# Ctrl-C says to somebody who waits for a job.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-submit hslt-status hslt-job hslt-render hslt-ca
ESCAPE=$(printf '\033')

# on_terminal FILE COMMAND...: all that the command writes to a terminal of its own
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

RENDER="$BIN/hslt-render $BOX --size 32x24 --integrator path --spp 4 --threads 1 -o $DIR/a.exr"
TERM=xterm on_terminal "$DIR/xterm" $RENDER || fail "hslt-render on a terminal: $(cat "$DIR/xterm")"
grep -q "$ESCAPE\[K" "$DIR/xterm" || fail "no bar on a terminal: $(cat -v "$DIR/xterm")"
TERM=dumb on_terminal "$DIR/dumb" $RENDER || fail "hslt-render on a dumb terminal: $(cat "$DIR/dumb")"
! grep -q "$ESCAPE" "$DIR/dumb" || fail "a dumb terminal gets escape sequences: $(cat -v "$DIR/dumb")"

start_coordinator
"$BIN/hslt-submit" "$BOX" --size 32x24 --integrator path --spp 4 -o later.exr --wait 2>"$DIR/wait.log" >"$DIR/id" &
WAITS=$!
PIDS="$PIDS $WAITS"
until_true 60 test -s "$DIR/id" || fail "no job: $(cat "$DIR/wait.log")"
# Without a worker nothing else can end the wait. What a shell starts in the background ignores SIGINT; SIGTERM is handled alike.
kill -TERM $WAITS
code=0
wait $WAITS || code=$?
[ $code -eq 143 ] || fail "it ends with $code: $(cat "$DIR/wait.log")"
for words in "the job continues" "hslt-job fetch j1 -o later.exr" "hslt-job cancel j1"; do
	grep -q "$words" "$DIR/wait.log" || fail "it does not say '$words': $(cat "$DIR/wait.log")"
done
"$BIN/hslt-job" list | grep -q '^j1 ' || fail "the job is gone"

TERM=xterm on_terminal "$DIR/colors" "$BIN/hslt-status" --socket "$DIR/status" || fail "$(cat "$DIR/colors")"
grep -q "$ESCAPE\[" "$DIR/colors" || fail "no colours: $(cat -v "$DIR/colors")"
NO_COLOR=1 TERM=xterm on_terminal "$DIR/none" "$BIN/hslt-status" --socket "$DIR/status" || fail "$(cat "$DIR/none")"
! grep -q "$ESCAPE" "$DIR/none" || fail "colours with NO_COLOR: $(cat -v "$DIR/none")"

"$BIN/hslt-ca" list --ca "$DIR/nothing" 2>"$DIR/ca.log" && fail "an authority that is not there has a list"
grep -q "hslt-ca init" "$DIR/ca.log" || fail "it does not say how to make one: $(cat "$DIR/ca.log")"
stop $COORDINATOR_PID
