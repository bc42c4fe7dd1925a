# SPDX-License-Identifier: Apache-2.0
# Checks deploy/kubernetes field by field against the published API and against the programs' options; certificates in
# the layout in which a kubelet mounts Secrets are read, and read again when they change; the workers' preStop hook
# makes a worker that is process 1 return its epochs. No cluster runs here.
. "$(dirname "$0")/lib.sh"
need hslt-ca hslt-coordinator hslt-worker hslt-submit hslt-status hslt-compare
PYTHON=/usr/bin/python3
"$PYTHON" -c 'import yaml, kubernetes' 2>/dev/null || lacks "no python3-kubernetes (deploy/setup.sh --full installs it)"
FILES=$(ls "$HERE"/../../deploy/kubernetes/*.yaml)
"$PYTHON" -B "$HERE/manifests.py" "$BIN" $FILES || fail "the manifests are not right"

for s in $(sed -n 's/^ *secretName: //p' $FILES); do
	grep -q "create secret generic $s --from-file" "$HERE/../../deploy/README.md" || fail "the README does not say how to make $s"
done

# secret NAME FOLDER: lays the folder out as a kubelet mounts a Secret: links through one link that is replaced
secret() {
	mkdir -p "$DIR/$1"
	new=$(mktemp -d "$DIR/$1/..start.XXXXXX")
	cp "$2"/*.pem "$new"
	chmod 755 "$new"
	chmod 440 "$new"/*.pem
	ln -s "$(basename "$new")" "$DIR/$1/..new"
	mv -T "$DIR/$1/..new" "$DIR/$1/..data"
	for f in "$2"/*.pem; do
		ln -sf "..data/$(basename "$f")" "$DIR/$1/$(basename "$f")"
	done
}
export HSLT_CA="$DIR/ca"
{ "$BIN/hslt-ca" init && "$BIN/hslt-ca" worker pods && "$BIN/hslt-ca" client client; } >>"$DIR/ca.log" 2>&1 || fail "hslt-ca"
secret coordinator-tls "$HSLT_CA/coordinator"
secret worker-tls "$HSLT_CA/pods"
export HSLT_TLS="$HSLT_CA/client"

if ! unshare --pid --fork --mount-proc true 2>/dev/null; then
	echo "the hook was not tried: no process namespaces here"
	exit 0
fi
start_coordinator --tls "$DIR/coordinator-tls"
submit "$BOX" -o "$DIR/pod.exr" --integrator hslt --bootstrap 20000 --mutations 4000000 --epoch 200 >"$DIR/id"
unshare --pid --fork --mount-proc --kill-child "$BIN/hslt-worker" --threads 1 --name pod --tls "$DIR/worker-tls" --cache "$DIR/cache" 2>>"$DIR/pod.log" &
outer=$!
PIDS="$PIDS $outer"
until_true 20 is_beyond "$(cat "$DIR/id")" 0.01 || fail "the pod does not work"
"$BIN/hslt-ca" worker pods --renew >>"$DIR/ca.log" 2>&1 || fail "hslt-ca"
secret worker-tls "$HSLT_CA/pods"
until_true 10 grep -q event=tls_read "$DIR/pod.log" || fail "a new Secret is not taken up"
grep -q event=tls_fault "$DIR/pod.log" && fail "it stumbled over it"
inner=$(cat /proc/$outer/task/$outer/children | tr -d ' ')
[ "$(sed -n 's/^NSpid:.*[[:space:]]//p' "/proc/$inner/status")" = 1 ] || fail "the worker is not process 1"
"$PYTHON" -B "$HERE/manifests.py" --hook $FILES >"$DIR/hook"
command=$(sed -n 3p "$DIR/hook")
[ "$(sed -n 1,2p "$DIR/hook" | tr '\n' ' ')" = "sh -c " ] && [ -n "$command" ] || fail "no hook: $(cat "$DIR/hook")"
begin=$(date +%s)
timeout 30 nsenter --target "$inner" --pid --mount sh -c "$command" 2>>"$DIR/hook.log" || : # it ends with process 1
code=0
wait $outer || code=$?
[ $code -eq 0 ] || fail "the worker ended with $code"
[ $(($(date +%s) - begin)) -lt 25 ] || fail "the hook took longer than the grace"
grep -q 'name="pod".*ended the connection' "$DIR/coordinator.log" || fail "the worker did not hand over"
[ "$(value "$(cat "$DIR/id")" failures)" = 0 ] || fail "leaving was counted as a failure"
echo "the hook: the worker finished its epochs and left"
