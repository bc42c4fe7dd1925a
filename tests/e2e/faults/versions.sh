# SPDX-License-Identifier: Apache-2.0
# Programs of different versions.

fault skew 3 1 "workers and clients of an older and a newer protocol connect"
skew() {
	farm
	worker w0
	worker w1
	job
	each_time strangers_call
	finish_job
}
strangers_call() {
	"$PYTHON" "$HERE/faults/skew.py" "${COORDINATOR#*:}" >"$DIR/skew.log" 2>&1 || fail "$NAME: $(cat "$DIR/skew.log")"
}

fault other_build 2 1 "for a while only a worker of another build is connected"
other_build() {
	other="$DIR/other-worker"
	"$PYTHON" - "$BIN/hslt-worker" "$other" <<'TEXT' || { cannot "no build id to change" && return; }
import re, subprocess, sys
with open(sys.argv[1], "rb") as f:
    program = bytearray(f.read())
note = re.search(rb"\x04\0\0\0\x14\0\0\0\x03\0\0\0GNU\0", program)
program[note.end()] ^= 255
with open(sys.argv[2], "wb") as f:
    f.write(program)
TEXT
	chmod +x "$other"
	farm
	worker w0
	job
	each_time another_comes
	finish_job
	grep -q event=batch_acknowledged "$DIR/o1.log" && fail "$NAME: the other build has worked on it"
	return 0
}
# The job is held until the other worker has gone, so that that worker does not end it.
another_comes() {
	hold_job
	stop "$WORKER"
	release_job
	"$other" --threads 1 --name o1 --cache "$DIR/cache" -v 2>>"$DIR/o1.log" &
	odd=$!
	PIDS="$PIDS $odd"
	until_true 30 waits_for_build || fail "$NAME: the status says: $(value "$ID" waiting)"
	stop $odd
	worker "w$i"
}
waits_for_build() {
	value "$ID" waiting | grep -q 'fingerprint\|build'
}
