# SPDX-License-Identifier: Apache-2.0
# A worker killed with -9 half-way, and one that comes late: the same bits as from one undisturbed worker.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-compare

JOB="--integrator hslt --bootstrap 20000 --mutations 2000000"
start_coordinator
start_worker calm
submit "$BOX" -o "$DIR/calm.exr" $JOB --wait >/dev/null

start_worker victim
victim=$WORKER
until_true 10 grep -q 'event=peer_hello.*name="victim"' "$DIR/coordinator.log" || fail "it does not come"
id=$(submit "$BOX" -o "$DIR/disturbed.exr" $JOB)
until_true 20 is_beyond "$id" 0.4 || fail "$id does not get on"
kill -9 $victim
start_worker late
until_true 30 is_state "$id" done || fail "$id is $(value "$id" state)"
"$BIN/hslt-job" fetch "$id" -o "$DIR/disturbed.exr"
same "$DIR/calm.exr" "$DIR/disturbed.exr"
grep -q 'name="victim".*the peer hung up\|name="victim".*reset\|name="victim".*broken pipe' "$DIR/coordinator.log" || fail "nobody was killed"
[ "$(value "$id" failures)" = 0 ] || fail "a killed worker is nobody's fault"
echo "equal bits with a worker killed and one late"
