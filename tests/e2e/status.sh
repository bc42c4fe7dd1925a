# SPDX-License-Identifier: Apache-2.0
# The status socket during a job: valid JSON, growing progress, lines for subscribers, and no access for other users.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-job

start_coordinator -v
[ "$(stat -c %a "$DIR/status")" = 600 ] || fail "the socket's mode is $(stat -c %a "$DIR/status")"
"$BIN/hslt-job" list | grep -q '^JOB .*ERROR' || fail "a list without jobs has no header"
id=$(submit "$BOX" -o "$DIR/a.exr" --integrator pssmlt --bootstrap 20000 --mutations 300000 --name "a \"name\" with ü")
is_state "$id" queued || fail "without workers a job waits"
[ -n "$(value "$id" waiting)" ] || fail "it does not say why it waits"
"$BIN/hslt-job" fetch --preview "$id" -o "$DIR/early.exr" 2>"$DIR/err.log" && fail "there is a preview of nothing"
grep -q "no round of $id is complete yet" "$DIR/err.log" || fail "a preview of nothing: $(cat "$DIR/err.log")"
code 1 "$BIN/hslt-job" fetch "$id" -o "$DIR/early.exr"
grep -q "it has no result; hslt-job fetch --preview" "$DIR/err.log" || fail "too early: $(cat "$DIR/err.log")"
for name in "$(printf %0200d 0)" "$(printf 'a\033[2J')"; do
	code 2 "$BIN/hslt-submit" "$BOX" -o "$DIR/b.exr" --spp 1 --name "$name"
	grep -q -e '--name takes 1 to 127 bytes of UTF-8 without control characters' "$DIR/err.log" || fail "a name: $(cat "$DIR/err.log")"
	code 2 "$BIN/hslt-worker" --name "$name" --cache "$DIR/cache"
done
long=$DIR/$(printf %0150d 0).xml # without --name the job has the file's name, truncated
cp "$BOX" "$long"
named=$(submit "$long" --path "$(dirname "$BOX")" -o "$DIR/b.exr" --integrator path --spp 1) || fail "a long name: $named"
[ "$(value "$named" name)" = "$(printf %0127d 0)" ] || fail "its name: $(value "$named" name)"
"$BIN/hslt-job" cancel "$named" >/dev/null
cp "$BOX" "$DIR/$(printf 'a\377.xml')"
code 6 "$BIN/hslt-submit" "$DIR/$(printf 'a\377.xml')" --path "$(dirname "$BOX")" -o "$DIR/b.exr" --integrator path --spp 1
grep -q "the scene's file name: at most 1024 bytes of UTF-8" "$DIR/err.log" || fail "a name that is no UTF-8: $(cat "$DIR/err.log")"
second=$(submit "$BOX" -o "$DIR/b.exr" --integrator path --spp 1)
"$BIN/hslt-job" cancel "$second" >/dev/null
code 1 "$BIN/hslt-job" fetch "$second" -o "$DIR/early.exr"
grep -q "is cancelled: it has no result$" "$DIR/err.log" || fail "a cancelled job: $(cat "$DIR/err.log")"
for list in "$BIN/hslt-status" "$BIN/hslt-job list"; do
	$list | grep -q "^$second  *cancelled [^#]*$" || fail "$list says twice that it is cancelled: $($list | grep "^$second")"
done
timeout 400 "$BIN/hslt-status" --json --watch "$id" >"$DIR/lines" &
watcher=$!
PIDS="$PIDS $watcher"
start_worker w1
wait $watcher || fail "watching ended with $?"
# hslt-status parses each line before it prints it; here the order of its lines is checked
sed -n 's/.*"progress":\([0-9.e-]*\).*/\1/p' "$DIR/lines" >"$DIR/progress"
awk 'NR > 1 && $1 < last { exit 1 } { last = $1; if ($1 > 0 && $1 < 1) between++ } END { if (last != 1 || between < 3) exit 1 }' \
	"$DIR/progress" || fail "progress: $(tr '\n' ' ' <"$DIR/progress")"
tail -n 1 "$DIR/lines" | grep -q '"state":"done"' || fail "the last line is not the end"
grep -q '"effects":\[{' "$DIR/lines" || fail "no effects are shown"
if command -v jq >/dev/null; then
	jq -e .id "$DIR/lines" >/dev/null || fail "jq does not take it"
fi
"$BIN/hslt-status" | grep -q "^$id  *done" || fail "the table does not show the job"
"$BIN/hslt-job" list --state done >"$DIR/done"
grep -q "^$id " "$DIR/done" && ! grep -q "^$second " "$DIR/done" || fail "list --state done: $(cat "$DIR/done")"
"$BIN/hslt-job" list --state cancelled --json >"$DIR/cancelled"
grep -q "\"id\": \"$second\"" "$DIR/cancelled" && ! grep -q "\"id\": \"$id\"" "$DIR/cancelled" || fail "list --state cancelled --json"
code 2 "$BIN/hslt-job" list --state dome
grep -q 'did you mean `done`' "$DIR/err.log" || fail "a state that there is not: $(cat "$DIR/err.log")"
code 2 "$BIN/hslt-job" cancel "$id" --state done
"$BIN/hslt-status" j99 2>/dev/null && fail "j99 cannot be known"
grep -q "event=lease_granted .* kind=render " "$DIR/coordinator.log" || fail "the log does not name the kinds of leases"
# A snapshot has fewer details about an ended job than the answer about one requested job.
"$BIN/hslt-status" "$id" | grep -q "^ *on .*direct" || fail "the job is shown without its effects"
"$BIN/hslt-status" --json | grep -q '"effects"' && fail "a snapshot has the effects of a job that ended"
"$BIN/hslt-status" --json --all | grep -q "\"id\":\"$id\"" || fail "--all lacks the job"
code 2 "$BIN/hslt-status" --all --watch
if "${PYTHON:-python3}" -c '' 2>/dev/null; then
	"${PYTHON:-python3}" -c '
import socket, sys
s = socket.socket(socket.AF_UNIX)
s.bind(sys.argv[1])
s.listen(1)
c = s.accept()[0]
c.sendall(b"{\"schema\":1,")
c.close()' "$DIR/half" &
	PIDS="$PIDS $!"
	until_true 10 test -S "$DIR/half" || fail "no socket"
	code 75 "$BIN/hslt-status" --socket "$DIR/half"
	grep -q "the coordinator closed the connection" "$DIR/err.log" || fail "half a line: $(cat "$DIR/err.log")"
	# The client disconnects between a snapshot and its request.
	"${PYTHON:-python3}" -c '
import socket, sys
s = socket.socket(socket.AF_UNIX)
s.bind(sys.argv[1])
s.listen(1)
for i in range(2):
	c = s.accept()[0]
	c.sendall(b"{\"schema\":1,\"type\":\"snapshot\",\"time\":1.0,\"jobs\":[],\"workers\":[],\"leases\":[]}\n")
	c.close()' "$DIR/short" &
	PIDS="$PIDS $!"
	until_true 10 test -S "$DIR/short" || fail "no socket"
	for asks in j1 --all; do
		code 75 "$BIN/hslt-status" --socket "$DIR/short" $asks
		grep -q "the coordinator is gone" "$DIR/err.log" || fail "$asks: $(cat "$DIR/err.log")"
	done
fi
if command -v socat >/dev/null; then
	cat >"$DIR/ask" <<-'TEXT'
		echo '{"subscribe":["jobs"]}'
		head -n 1 >"$HEARD"
	TEXT
	# socat's exit code is ignored: it is 1 if the next update comes before socat notices that its reader has left.
	HEARD=$DIR/heard socat "UNIX-CONNECT:$DIR/status" "EXEC:sh $DIR/ask" 2>"$DIR/socat.log" || :
	grep -q '"type":"snapshot"' "$DIR/heard" || fail "socat reads no snapshot: $(cat "$DIR/heard" "$DIR/socat.log")"
fi
echo "status: $(wc -l <"$DIR/lines") lines, progress grows"
