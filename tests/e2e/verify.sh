# SPDX-License-Identifier: Apache-2.0
# A worker whose results have one wrong bit, among honest ones: with --verify 1 the image is that of hslt-render, the
# faulty worker is quarantined permanently, and none of its results count as failures of the job. A share of verified
# leases finds a worker that is wrong now and then. A note says how much was merged unverified. First: which connections
# are replaced when a worker starts again.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-render hslt-job hslt-compare

# says FILE WORDS: checks that the file contains the words
says() {
	grep -q -F -- "$2" "$1" || fail "$1 does not say '$2': $(tail -n 5 "$1" | cut -c 1-600)"
}

is_quarantined() {
	"$BIN/hslt-status" >"$DIR/shown"
	grep -q "quarantined: $1" "$DIR/shown"
}

JOB="--integrator hslt --size 96x96 --bootstrap 20000 --mutations 640000 --chains 64 --epoch 2500"
"$BIN/hslt-render" "$BOX" -o "$DIR/alone.exr" $JOB 2>"$DIR/render.log"

start_coordinator --heartbeat 60
python3 "$HERE/starts.py" "${COORDINATOR#*:}" || fail "restarted workers"
stop $COORDINATOR_PID
start_coordinator
[ "$("$BIN/hslt-job" workers)" = "no workers are connected" ] || fail "without workers: $("$BIN/hslt-job" workers)"
start_worker honest1
a=$WORKER
id=$(submit "$BOX" -o "$DIR/all.exr" $JOB --verify 100%)
waits() {
	[ "$(value "$id" waiting | cut -c 1-38)" = "verification waits for a second worker" ]
}
until_true 20 waits || fail "it waits for '$(value "$id" waiting)'"
start_faulty_worker liar lie=2
liar=$WORKER
until_true 10 grep -q 'event=peer_hello.*name="liar"' "$DIR/coordinator.log" || fail "the liar does not come"
start_worker honest2
b=$WORKER
until_true 60 is_state "$id" done || fail "$id is $(value "$id" state): $(value "$id" why)"
"$BIN/hslt-job" fetch "$id" -o "$DIR/all.exr"
same "$DIR/alone.exr" "$DIR/all.exr"
[ "$(value "$id" failures)" = 0 ] || fail "$(value "$id" failures) failures of the job"
[ "$(value "$id" verified)" -ge 64 ] || fail "$(value "$id" verified) leases were verified"
[ "$(value "$id" mismatched)" -ge 3 ] || fail "$(value "$id" mismatched) were mismatched"
found="$(value "$id" verified) leases verified, $(value "$id" mismatched) of which differed at first"
is_quarantined liar || fail "the liar is trusted: $(cat "$DIR/shown")"
says "$DIR/shown" "wrong result: j1"
says "$DIR/coordinator.log" "event=worker_quarantined"
"$BIN/hslt-job" workers >"$DIR/workers"
grep -q '^liar  *quarantined .*wrong result: j1' "$DIR/workers" && grep -q '^honest1  *active ' "$DIR/workers" ||
	fail "hslt-job workers: $(cat "$DIR/workers")"
"$BIN/hslt-job" workers --json >"$DIR/workers"
says "$DIR/workers" '"state": "quarantined"'
"$BIN/hslt-job" log "$id" >"$DIR/log"
says "$DIR/log" "worker=\"liar\""

# The worker is recognised after its own restart, under another name, and after a restart of the coordinator.
stop $liar
start_worker saint
saint=$WORKER
until_true 10 grep -q 'is quarantined and gets no work' "$DIR/saint.log" || fail "the liar's home is trusted under another name"
kill -9 $COORDINATOR_PID
wait $COORDINATOR_PID 2>/dev/null || :
LISTEN=$COORDINATOR
start_coordinator --verify 0.5 --forgive lair
says "$DIR/coordinator.log" 'event=worker_not_forgiven name="lair" text="nobody of that name is quarantined; did you mean `liar`?"'
is_quarantined liar || fail "a restart made an honest worker of it"
until_true 10 sh -c "[ \$(grep -c 'is quarantined and gets no work' '$DIR/saint.log') -ge 2 ]" || fail "it is trusted after a restart"
id=$(submit "$BOX" -o "$DIR/half.exr" $JOB --wait)
same "$DIR/alone.exr" "$DIR/half.exr"
[ "$(value "$id" verify)" = 0.5 ] || fail "the least share is $(value "$id" verify)"

# Its unverified results cannot be removed: the note says how many there are. Some are merged before the worker is found
# out.
stop $saint $a $b
kill -9 $COORDINATOR_PID
wait $COORDINATOR_PID 2>/dev/null || :
start_coordinator --forgive liar
says "$DIR/coordinator.log" "event=worker_forgiven"
start_faulty_worker liar lie=1
id=$(submit "$BOX" -o "$DIR/some.exr" $JOB --verify 0.3)
until_true 20 waits || fail "it waits for '$(value "$id" waiting)'"
start_worker honest3
start_worker honest4
until_true 60 is_state "$id" done || fail "$id is $(value "$id" state): $(value "$id" why)"
# The last leases of the job may be the verified ones, so that the worker is found out as the job ends.
tells() {
	"$BIN/hslt-status" "$id" >"$DIR/shown"
	grep -q "worker liar is quarantined (wrong result: j" "$DIR/shown"
}
until_true 20 tells || fail "the status of $id does not say who is quarantined: $(cat "$DIR/shown")"
says "$DIR/shown" "of its leases were merged unverified"
"$BIN/hslt-job" log "$id" >"$DIR/log"
says "$DIR/log" "merged unverified"
echo "a wrong bit is found: $found"
