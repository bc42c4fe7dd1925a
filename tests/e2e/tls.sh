# SPDX-License-Identifier: Apache-2.0
# A farm over TLS: the bits are the same, and everyone who must not get in is refused. The table of attempts in
# README.md must be up to date.
#   sh tests/e2e/tls.sh BUILD [--write]     --write: writes the table
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-job hslt-ca hslt-render hslt-compare
unset HSLT_TLS
CA="$DIR/ca"
export HSLT_CA="$CA"
ROWS=0

ca() {
	"$BIN/hslt-ca" "$@" >>"$DIR/ca.log" 2>&1 || fail "hslt-ca $*: $(tail -n 1 "$DIR/ca.log")"
}

row() {
	ROWS=$((ROWS + 1))
	printf '%-48s %-8s %s\n' "$1" "$2" "$3"
	printf '%s|%s\n' "$2" "$1" >>"$DIR/attempts"
}

# tries WHAT: announces an attempt
tries() {
	printf 'tried|%s\n' "$1" >>"$DIR/attempts"
}

# refused WHAT CODE SENTENCE COMMAND...: the command must end with that code and message
refused() {
	what=$1 wanted=$2 sentence=$3
	shift 3
	got=0
	tries "$what"
	timeout 100 "$@" >"$DIR/out" 2>"$DIR/err.log" || got=$?
	[ $got -eq "$wanted" ] || fail "$what: ended with $got, not $wanted: $(cat "$DIR/err.log")"
	grep -q -e "$sentence" "$DIR/err.log" || fail "$what: it says: $(cat "$DIR/err.log")"
	row "$what" refused "$sentence"
}

# turned_away WHAT SENTENCE WORKER-LOG: a running worker must be told so, and the status must not show it
turned_away() {
	tries "$1"
	until_true 20 grep -qs "$2" "$DIR/$3.log" || fail "$1: $(cat "$DIR/$3.log")"
	"$BIN/hslt-status" --json | grep -q "\"name\":\"$3\"" && fail "$1: it has joined"
	row "$1" refused "$2"
}

# Three commands set up a farm; the others make certificates of parties that must not get in.
ca init
ca worker node
ca client ann
ca client bob
ca operator chief
ca worker lost
ca client gone
ca client late --days 1s
ca init --ca "$DIR/other"
ca client eve --ca "$DIR/other"
ca worker eve-node --ca "$DIR/other"
[ "$(stat -c %a "$CA/ca.key" "$CA/node/key.pem" "$CA/node" | tr '\n' ' ')" = "600 600 700 " ] || fail "modes of keys"
"$BIN/hslt-ca" list | grep -q '^lost *worker *valid' || fail "hslt-ca list: $("$BIN/hslt-ca" list)"
ca revoke gone

"$BIN/hslt-render" "$BOX" -o "$DIR/alone.exr" --integrator path --spp 16 2>>"$DIR/render.log"
start_coordinator --tls "$CA/coordinator" --tls-check 0.5 --quota-assets 0.1
start_worker node1 --tls "$CA/node"
start_worker node2 --tls "$CA/node"
start_worker lost --tls "$CA/lost"
ca worker brief --days 0.00017 # 15 s, within which the worker must connect
start_worker brief --tls "$CA/brief"
until_true 10 grep -q 'event=peer_hello.*name="brief"' "$DIR/coordinator.log" || fail "the worker whose certificate is about to expire does not come"
export HSLT_TLS="$CA/ann"
submit "$BOX" -o "$DIR/farm.exr" --integrator path --spp 16 --wait >"$DIR/id" || fail "the job: $?"
same "$DIR/alone.exr" "$DIR/farm.exr"

printf '%-48s %-8s %s\n' TRIED GOT BECAUSE
ROWS=0
list="$BIN/hslt-job list"
refused "no certificate: plaintext to the TLS port" 6 "speaks TLS" $list --tls ""
refused "a worker's certificate submits" 6 "cannot submit" "$BIN/hslt-submit" "$BOX" -o "$DIR/no.exr" --spp 1 --tls "$CA/node"
refused "a worker's certificate lists jobs" 6 "cannot submit" $list --tls "$CA/node"
refused "a coordinator's certificate lists jobs" 6 "does not accept this certificate" $list --tls "$CA/coordinator"
refused "a certificate of another authority" 6 "is not accepted" $list --tls "$DIR/other/eve"
cp -r "$DIR/other/eve" "$DIR/eve"
cp "$CA/ca.pem" "$CA/crl.pem" "$DIR/eve"
refused "the same, and it trusts this farm" 6 "unknown CA" $list --tls "$DIR/eve"
refused "an expired certificate" 6 "certificate expired" $list --tls "$CA/late"
refused "a revoked certificate" 6 "certificate revoked" $list --tls "$CA/gone"
cp -r "$CA/ann" "$DIR/open"
chmod 644 "$DIR/open/key.pem"
refused "a key that everybody can read" 2 "everybody on this machine" $list --tls "$DIR/open"
refused "holding a job of somebody else" 1 "no such job" "$BIN/hslt-job" hold j1 --tls "$CA/bob"
refused "cancelling a job of somebody else" 1 "no such job" "$BIN/hslt-job" cancel j1 --tls "$CA/bob"
refused "fetching a job of somebody else" 1 "no such job" "$BIN/hslt-job" fetch j1 -o "$DIR/no.exr" --tls "$CA/bob"
refused "its preview" 1 "no such job" "$BIN/hslt-job" fetch j1 --preview -o "$DIR/no.exr" --tls "$CA/bob"
refused "its log" 1 "no such job" "$BIN/hslt-job" log j1 --tls "$CA/bob"
tries "seeing a job of somebody else in the list"
$list --tls "$CA/bob" | grep -q '^j' && fail "bob sees: $($list --tls "$CA/bob")"
row "seeing a job of somebody else in the list" refused "not there"
$list | grep -q '^j1 ' || fail "ann does not see her job"
$list --tls "$CA/chief" | grep -q '^j1 ' || fail "an operator does not see it"
"$BIN/hslt-job" fetch j1 -o "$DIR/again.exr" --tls "$CA/chief" || fail "an operator cannot fetch"
same "$DIR/alone.exr" "$DIR/again.exr"

start_worker as-client --tls "$CA/ann"
as_client=$WORKER
turned_away "a client's certificate leases" "cannot take leases" as-client
CODE=0
wait "$as_client" || CODE=$?
[ $CODE -eq 6 ] || fail "a worker with a client's certificate ends with $CODE, not 6: $(cat "$DIR/as-client.log")"
start_worker foreign --tls "$DIR/other/eve-node"
turned_away "a worker of another authority" "is not accepted" foreign
kill -9 "$WORKER"
start_worker plain --tls ""
turned_away "a worker without TLS" "speaks TLS" plain
kill -9 "$WORKER"

# Peers that do not speak TLS get an answer or are disconnected, and are never left waiting.
tries "HTTP to the TLS port"
timeout 100 "${PYTHON:-python3}" -c '
import socket, sys
s = socket.create_connection(("127.0.0.1", int(sys.argv[1])))
s.settimeout(60)
s.sendall(b"GET / HTTP/1.0\r\n\r\n")
sys.exit(0 if s.recv(64)[:1] == b"\x15" and s.recv(64) == b"" else 1)' "${COORDINATOR#*:}" || fail "a client that speaks HTTP is not disconnected"
row "HTTP to the TLS port" refused "an alert, and hung up"

# A valid certificate with invalid messages.
tricks=$(cd "$HERE" && pwd)/intruder.py
(cd "$DIR" && exec "${PYTHON:-python3}" -B "$tricks" "${COORDINATOR#*:}" "$CA/ann" "$CA/bob") >"$DIR/tricks" 2>"$DIR/err.log" || fail "$(cat "$DIR/err.log")"
while IFS='|' read -r what answer; do
	tries "$what"
	row "$what" refused "$answer"
done <"$DIR/tricks"

# Scenes that name files outside their folder.
mkdir "$DIR/scene"
echo "v 0 0 0" >"$DIR/secret.obj"
ln -s ../secret.obj "$DIR/scene/link.obj"
ln -s /dev/zero "$DIR/scene/device.obj"
mkfifo "$DIR/scene/pipe.obj"
asks_for() {
	sed "s|meshes/wedge.obj|$1|" "$BOX" >"$DIR/scene/box.xml"
	refused "path tricks: a scene asks for $2" 1 "$3" "$BIN/hslt-submit" "$DIR/scene/box.xml" -o "$DIR/no.exr" --integrator path --spp 1
}
asks_for "$DIR/secret.obj" "an absolute path" "leads out of the scene.s folder"
asks_for ../secret.obj "../secret.obj" "leads out of the scene.s folder"
asks_for link.obj "a link that leads out" "must lie below\|outside\|link"
asks_for device.obj "a device" "."
asks_for pipe.obj "a named pipe" "."

# Output names of images: fetching another owner's job does not overwrite one's own files.
programs=$(cd "$BIN" && pwd)
mkdir "$DIR/home"
echo precious >"$DIR/home/room.exr"
is_listed_done() {
	$list --tls "$CA/chief" | grep -q "^$1 *done"
}
calls_it() {
	id=$("$BIN/hslt-submit" "$BOX" -o "$1" --integrator path --spp 1 --tls "$CA/bob" 2>>"$DIR/submit.log")
	until_true 20 is_listed_done "$id" || fail "$id does not end"
	refused "path tricks: an image that is called $2" 1 "$3" env -C "$DIR/home" "$programs/hslt-job" fetch "$id" --tls "$CA/chief"
}
calls_it "$DIR/home/.profile" "/home/ann/.profile" "the name of the job's image cannot be used"
calls_it ../home/room.exr "like one that is there" "exists: -o FILE"
[ "$(ls -A "$DIR/home")" = room.exr ] && [ "$(cat "$DIR/home/room.exr")" = precious ] || fail "it was written over: $(ls -lA "$DIR/home")"

# Live connections whose certificate is revoked or expires.
tries "a worker that is revoked while it is connected"
tries "a worker whose certificate expires meanwhile"
ca revoke lost
until_true 10 grep -q 'peer_refused.*name=.\{0,1\}lost.*revoked' "$DIR/coordinator.log" || fail "the revoked worker stays"
row "a worker that is revoked while it is connected" "cut off" "certificate revoked"
until_true 10 grep -q 'peer_refused.*name=.\{0,1\}brief.*expired' "$DIR/coordinator.log" || fail "the expired worker stays"
row "a worker whose certificate expires meanwhile" "cut off" "certificate has expired"

# Warnings about a certificate that expires soon appear in the log, in the status and at the terminal, and only for the
# party that owns it.
grep -q 'event=tls_expiry' "$DIR/coordinator.log" "$DIR/node1.log" && fail "a warning without a reason"
grep -q 'level=warn event=tls_expiry text="the certificate of brief expires in' "$DIR/brief.log" || fail "no warning in the worker's log"
ca client soon --days 5
$list --tls "$CA/soon" 2>&1 >/dev/null | grep -q 'warning: the certificate of soon expires in 5 days' || fail "no warning for a client"
$list 2>&1 >/dev/null | grep -q warning && fail "a warning for ann without a reason"

# A renewed certificate is loaded without a restart, and the farm continues with the same bits.
ca coordinator coordinator --renew
until_true 5 grep -q event=tls_read "$DIR/coordinator.log" || fail "new files are not noticed"
chains="--integrator pssmlt --bootstrap 20000 --mutations 200000 --epoch 50"
"$BIN/hslt-render" "$BOX" -o "$DIR/alone2.exr" $chains 2>>"$DIR/render.log"
begun=$(date +%s)
submit "$BOX" -o "$DIR/farm2.exr" $chains --wait >"$DIR/id" || fail "the second job: $?"
took=$(($(date +%s) - begun))
same "$DIR/alone2.exr" "$DIR/farm2.exr"

# Rotation: the authority's certificate lasts a week, the coordinator's a day, the worker's longer than that job took.
# New certificates are there before the old ones expire, and a job that began over the old ones finishes over the new
# ones.
export HSLT_CA="$DIR/week"
ca init --days 7
ca coordinator coordinator --renew --days 1
ca worker swift --days "$(awk -v s=$took 'BEGIN { print (6 + 2 * s) / 86400 }')"
ca client ann
"$BIN/hslt-coordinator" --listen 127.0.0.1:0 --port-file "$DIR/port3" --spool "$DIR/spool4" --status-socket "$DIR/status4" --heartbeat 0.5 \
	--tls "$HSLT_CA/coordinator" --tls-check 0.5 2>>"$DIR/week.log" &
PIDS="$PIDS $!"
until_true 10 test -s "$DIR/port3" || fail "the coordinator does not listen"
week="--coordinator 127.0.0.1:$(cat "$DIR/port3") --tls $HSLT_CA/ann"
week_value() {
	"$BIN/hslt-status" --socket "$DIR/status4" --json | grep -o "\"$1\":[0-9.]*" | head -n 1 | cut -d: -f2
}
week_greets() {
	[ "$(grep -c 'event=peer_hello.*name="swift"' "$DIR/week.log")" -ge "$1" ]
}
week_merges() {
	[ "$(week_value merged)" -ge 10 ]
}
start_worker swift --tls "$HSLT_CA/swift" --coordinator "127.0.0.1:$(cat "$DIR/port3")"
until_true 5 week_greets 1 || fail "the worker does not come"
"$BIN/hslt-submit" $week "$BOX" -o "$DIR/rotated.exr" $chains >>"$DIR/id" 2>>"$DIR/submit.log" || fail "the job: $?"
until_true 10 week_merges || fail "the job does not begin"
"$BIN/hslt-job" $week hold j1 2>>"$DIR/submit.log" || fail "hold: $?"
grep -q 'certificate of coordinator expires in 1 days.*; the authority.s certificate expires in 7 days' "$DIR/week.log" ||
	fail "the coordinator does not warn"
"$BIN/hslt-status" --socket "$DIR/status4" >"$DIR/shown"
grep -q '^warning: the certificate of coordinator .*authority' "$DIR/shown" &&
	grep -q '^warning: swift: the certificate of swift expires' "$DIR/shown" || fail "the status does not warn: $(cat "$DIR/shown")"
[ "$(week_value certificateUntil)" -lt $(($(date +%s) + 90000)) ] || fail "the status has another end: $(week_value certificateUntil)"
ca coordinator coordinator --renew
ca worker swift --renew
until_true 15 grep -q 'peer_refused.*name="swift".*expired' "$DIR/week.log" || fail "the old certificate does not end"
until_true 5 week_greets 2 || fail "the worker does not come back with the new one"
[ "$(week_value certificateUntil)" -gt $(($(date +%s) + 500000)) ] || fail "the coordinator has the old one: $(week_value certificateUntil)"
"$BIN/hslt-job" $week release j1 2>>"$DIR/submit.log" || fail "release: $?"
until_true 60 "$BIN/hslt-job" $week fetch j1 -o "$DIR/rotated.exr" 2>>"$DIR/submit.log" || fail "the job does not end"
same "$DIR/alone2.exr" "$DIR/rotated.exr"
row "a certificate that was renewed in time" "let in" "no restart, equal bits"

# A client whose certificate expires while it waits for an image is refused until it has a new one, and then gets the
# image.
week_says() {
	grep -q "$1" "$DIR/week.log"
}
week_is_refused() {
	[ "$(grep -c 'event=peer_refused.*expired' "$DIR/week.log")" -ge $((refusals + 2)) ]
}
refusals=$(grep -c 'event=peer_refused.*expired' "$DIR/week.log")
ca client slow --days 0.00012
"$BIN/hslt-submit" ${week%ann}slow "$BOX" -o "$DIR/waited.exr" $chains --wait >>"$DIR/id" 2>"$DIR/waited.log" &
waits=$!
PIDS="$PIDS $waits"
until_true 8 week_says 'event=job_state job=j2' || fail "the second job does not come"
"$BIN/hslt-job" ${week%ann}slow hold j2 2>>"$DIR/submit.log" || fail "hold: $?"
until_true 30 week_is_refused || fail "the expired client stays, or does not come again: $(cat "$DIR/waited.log")"
ca client slow --renew
"$BIN/hslt-job" ${week%ann}slow release j2 2>>"$DIR/submit.log" || fail "release: $?"
CODE=0
wait "$waits" || CODE=$?
[ $CODE -eq 0 ] || fail "who waited ends with $CODE: $(cat "$DIR/waited.log")"
same "$DIR/alone2.exr" "$DIR/waited.exr"
row "a client whose certificate expires while it waits" "let in" "after it was renewed, equal bits"
kill -9 "$WORKER"

# All clients may see which workers there are; only operators see what went wrong there. This worker crashes with its
# first lease.
ca operator chief
start_faulty_worker clumsy crash=1 --tls "$HSLT_CA/swift" --coordinator "127.0.0.1:$(cat "$DIR/port3")"
"$BIN/hslt-submit" $week "$BOX" -o "$DIR/third.exr" $chains >>"$DIR/id" 2>>"$DIR/submit.log" || fail "the third job: $?"
chief_reads() {
	"$BIN/hslt-job" ${week%ann}chief workers >"$DIR/workers" && grep -q '^clumsy  *active  .*SIGSEGV' "$DIR/workers"
}
until_true 10 chief_reads || fail "hslt-job workers says to an operator: $(cat "$DIR/workers")"
ann_reads() {
	"$BIN/hslt-job" $week workers >"$DIR/workers"
	! grep -q SIGSEGV "$DIR/workers" || fail "a client reads of faults: $(cat "$DIR/workers")"
	grep -q '^clumsy  *active  *[0-9]*  *1 ' "$DIR/workers"
}
until_true 10 ann_reads || fail "hslt-job workers says to a client: $(cat "$DIR/workers")"
kill -9 "$WORKER"
export HSLT_CA="$CA"
ROWS=$((ROWS - 2))

# The other way round: TLS to a port without TLS; and only a coordinator's certificate can serve as one.
"$BIN/hslt-coordinator" --listen 127.0.0.1:0 --port-file "$DIR/port2" --spool "$DIR/spool2" --status-socket "$DIR/status2" --tls "" \
	--quota-jobs 2 --quota-film 5 --quota-mutations 100000 --quota-assets 0.02 \
	2>>"$DIR/plain-coordinator.log" &
PIDS="$PIDS $!"
until_true 10 test -s "$DIR/port2" || fail "the plain coordinator does not listen"
refused "TLS to a port without" 6 "does not speak TLS" $list --coordinator "127.0.0.1:$(cat "$DIR/port2")"
# Quotas of a client; the box has 1,920 pixels, which are one tile of 4.7 MB in 16 groups, and 2 KB of files. There is
# no worker, so that jobs stay.
plain="$BIN/hslt-submit --coordinator 127.0.0.1:$(cat "$DIR/port2") --tls"
refused "a film beyond the quota" 6 "quota: the films need" $plain "" "$BOX" -o "$DIR/no.exr" --integrator path --spp 16 --size 100x80
refused "groups beyond the quota" 6 "quota: the films need" $plain "" "$BOX" -o "$DIR/no.exr" --integrator path --spp 64 --groups 64
refused "samples beyond the quota" 6 "quota: .* samples" $plain "" "$BOX" -o "$DIR/no.exr" --integrator path --spp 1000
refused "samples without a bound" 6 "quota: at most" $plain "" "$BOX" -o "$DIR/no.exr" --integrator path --target-error 1%
cp -r "$(dirname "$BOX")" "$DIR/large"
{ echo '<?xml version="1.0"?>' && printf '<!--%30000s-->\n' '' && grep -v '^<?xml' "$BOX"; } >"$DIR/large/box.xml"
refused "files beyond the quota" 6 "quota: its files" $plain "" "$DIR/large/box.xml" -o "$DIR/no.exr" --integrator path --spp 1
for k in 1 2; do
	$plain "" "$BOX" -o "$DIR/yes.exr" --integrator path --spp 16 >>"$DIR/id" 2>>"$DIR/submit.log" || fail "job $k of 2 is refused"
done
refused "jobs beyond the quota" 6 "quota: at most 2 live jobs" $plain "" "$BOX" -o "$DIR/no.exr" --integrator path --spp 1

refused "a worker's certificate as coordinator" 2 "no peer would accept it" "$BIN/hslt-coordinator" --listen 127.0.0.1:0 \
	--spool "$DIR/spool3" --tls "$CA/node"
refused "an open port without TLS" 2 "--insecure" "$BIN/hslt-coordinator" --listen 0.0.0.0:0 --spool "$DIR/spool3" \
	--status-socket "$DIR/status3" --tls ""

awk -f "$HERE/faults/kinds.awk" "$DIR/attempts" >"$DIR/kinds" || fail "of no kind, never tried, or not refused: $(cat "$DIR/kinds")"
{
	echo '| attempts | what | tried | refused |'
	echo '|---|---|---|---|'
	sed 's/|/ | /g; s/^/| /; s/$/ |/' "$DIR/kinds"
} >"$DIR/table"
[ "${2:-}" != --write ] || write_table attempts "$DIR/table"
sed -n '/<!-- attempts -->/,/<!-- end -->/p' "$HERE/README.md" | grep '^|' | diff - "$DIR/table" >"$DIR/diff" ||
	fail "the table of README.md has other attempts than there were (sh tests/e2e/tls.sh $BUILD --write writes it): $(cat "$DIR/diff")"
echo "TLS: equal bits; $ROWS attempts, all refused"
