# SPDX-License-Identifier: Apache-2.0
# Thousands of connections use a bounded amount of the coordinator's memory: chunks of files become smaller, and only
# some submissions may wait for their files at once.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-submit hslt-status hslt-job
[ "$(ulimit -Hn)" = unlimited ] || [ "$(ulimit -Hn)" -ge 4096 ] || skip "2,000 connections need as many descriptors"
ulimit -n 4096

start_coordinator --heartbeat 60
{
	cat "$BOX"
	awk 'BEGIN { for (i = 0; i < 30000; i++) printf "<!-- what makes the file one of a few megabytes, line %06d -->\n", i }'
} >"$DIR/large.xml"
id=$(submit "$DIR/large.xml" -o "$DIR/a.exr" --path "$(dirname "$BOX")" --integrator path --spp 1) || fail "$(tail -n 1 "$DIR/submit.log")"
"${PYTHON:-python3}" "$HERE/faults/throng.py" "${COORDINATOR#*:}" "${id#j}" "$DIR/large.xml" >"$DIR/throng.log" 2>&1 ||
	fail "$(tail -n 1 "$DIR/throng.log")"
read -r _ chunk _ waiting <"$DIR/throng.log"
[ "$chunk" -lt 600000 ] || fail "a chunk of $chunk bytes for one of 2,000 peers"
[ "$waiting" -gt 20 ] && [ "$waiting" -lt 400 ] || fail "$waiting submissions wait for their files"
grep -q accepted "$DIR/throng.log" || fail "none is accepted later"
"$BIN/hslt-job" cancel "$id" >/dev/null || fail "the coordinator does not answer"
echo "2,000 peers: chunks of $chunk bytes, $waiting submissions at once"
