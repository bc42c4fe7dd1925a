# deploy/kubernetes field by field against the published API, and against the programs' options; the workers' preStop hook lets
# a worker that is process 1 hand over its epochs. No cluster runs here.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-compare
PYTHON=/usr/bin/python3
"$PYTHON" -c 'import yaml, kubernetes' 2>/dev/null || skip "no python3-kubernetes (deploy/setup.sh --full installs it)"
FILES=$(ls "$HERE"/../../deploy/kubernetes/*.yaml)
"$PYTHON" -B "$HERE/manifests.py" "$BIN" $FILES || fail "the manifests are not right"

if ! unshare --pid --fork --mount-proc true 2>/dev/null; then
	echo "the hook was not tried: no process namespaces here"
	exit 0
fi
start_coordinator
submit "$BOX" -o "$DIR/pod.exr" --integrator hslt --bootstrap 20000 --mutations 4000000 --epoch 200 >"$DIR/id"
unshare --pid --fork --mount-proc --kill-child "$BIN/hslt-worker" --threads 1 --name pod --cache "$DIR/cache" 2>>"$DIR/pod.log" &
outer=$!
PIDS="$PIDS $outer"
until_true 20 is_beyond "$(cat "$DIR/id")" 0.01 || fail "the pod does not work"
inner=$(cat /proc/$outer/task/$outer/children | tr -d ' ')
[ "$(sed -n 's/^NSpid:.*[[:space:]]//p' "/proc/$inner/status")" = 1 ] || fail "the worker is not process 1"
"$PYTHON" -B "$HERE/manifests.py" --hook $FILES >"$DIR/hook"
command=$(sed -n 3p "$DIR/hook")
[ "$(sed -n 1,2p "$DIR/hook" | tr '\n' ' ')" = "sh -c " ] && [ -n "$command" ] || fail "no hook: $(cat "$DIR/hook")"
begin=$(date +%s)
timeout 30 nsenter --target "$inner" --pid --mount sh -c "$command" 2>>"$DIR/hook.log" || : # it goes with process 1
code=0
wait $outer || code=$?
[ $code -eq 0 ] || fail "the worker ended with $code"
[ $(($(date +%s) - begin)) -lt 25 ] || fail "the hook took longer than the grace"
grep -q 'name="pod".*said goodbye' "$DIR/coordinator.log" || fail "the worker did not hand over"
[ "$(value "$(cat "$DIR/id")" failures)" = 0 ] || fail "leaving was counted as a failure"
echo "the hook: the worker finished its epochs and left"
