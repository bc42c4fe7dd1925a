# SIGTERM: a worker finishes or gives back its leases and leaves with 0; the job loses nothing and nobody is blamed.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-compare

JOB="--integrator hslt --bootstrap 20000 --mutations 1500000"
start_coordinator
start_worker stays
submit "$BOX" -o "$DIR/calm.exr" $JOB --wait >/dev/null
start_worker leaves
leaves=$WORKER
start_worker hurries --grace 0
hurries=$WORKER
id=$(submit "$BOX" -o "$DIR/left.exr" $JOB)
until_true 20 is_beyond "$id" 0.3 || fail "$id does not get on"
stop $leaves
[ $CODE -eq 0 ] || fail "leaving ended with $CODE"
stop $hurries
[ $CODE -eq 0 ] || fail "leaving in a hurry ended with $CODE"
until_true 30 is_state "$id" done || fail "$id is $(value "$id" state)"
[ "$(value "$id" failures)" = 0 ] || fail "leaving was counted as a failure"
"$BIN/hslt-job" fetch "$id" -o "$DIR/left.exr"
same "$DIR/calm.exr" "$DIR/left.exr"
echo "workers leave in peace"
