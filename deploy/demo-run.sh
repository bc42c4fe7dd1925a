#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Renders the demo scene with the programs in BUILD/bin: deploy/demo-run.sh BUILD OUT [OPTION OF hslt-submit...]
#
# Starts a coordinator and two workers on loopback, whose spool is deleted afterwards. Writes OUT/demo.exr and OUT/demo.png.
set -eu
cd "$(dirname "$0")/.."
bin=${1:?usage: demo-run.sh BUILD OUT [OPTION...]}/bin
out=${2:?usage: demo-run.sh BUILD OUT [OPTION...]}
shift 2
dir=$(mktemp -d "${TMPDIR:-/tmp}/hslt-demo.XXXXXX")
pids=""

# Ends the processes that were started: SIGTERM, and SIGKILL to those still running after two seconds in total.
finish() {
	code=$?
	trap - EXIT
	trap '' INT TERM HUP
	for p in $pids; do
		kill "$p" 2>/dev/null || :
	done
	tries=20
	for p in $pids; do
		while kill -0 "$p" 2>/dev/null && [ $tries -gt 0 ]; do
			sleep 0.1
			tries=$((tries - 1))
		done
		kill -9 "$p" 2>/dev/null || :
	done
	wait
	if [ $code -ne 0 ] && [ $code -ne 130 ]; then
		tail -n 5 "$dir"/*.log >&2 || :
	fi
	rm -rf "$dir"
	exit $code
}
trap finish EXIT
trap 'exit 130' INT TERM HUP

threads=$(($(nproc 2>/dev/null || echo 2) / 2))
[ $threads -gt 0 ] || threads=1
mkdir -p "$out"
rm -f "$out/demo.exr" "$out/demo.png"

"$bin/hslt-coordinator" --listen 127.0.0.1:0 --port-file "$dir/port" --spool "$dir/spool" --status-socket "$dir/status" \
	2>"$dir/coordinator.log" &
coordinator=$!
pids="$coordinator"
until [ -s "$dir/port" ]; do
	if ! kill -0 $coordinator 2>/dev/null; then
		echo "demo: the coordinator did not start" >&2
		exit 1
	fi
	sleep 0.05
done
HSLT_COORDINATOR=127.0.0.1:$(cat "$dir/port")
HSLT_STATUS_SOCKET=$dir/status
export HSLT_COORDINATOR HSLT_STATUS_SOCKET
for n in 1 2; do
	"$bin/hslt-worker" --name "worker$n" --threads $threads --cache "$dir/cache$n" --grace 1 2>"$dir/worker$n.log" &
	pids="$pids $!"
done

begin=$(date +%s)
echo "rendering tests/scenes/demo/scene.xml with two workers of $threads thread(s)"
"$bin/hslt-submit" tests/scenes/demo/scene.xml -o "$out/demo.exr" --wait "$@" >"$dir/id" &
submit=$!
pids="$pids $submit"

# Whether the farm's state should be shown: once, in the middle of the work (or at its end if that comes sooner).
half_done() {
	"$bin/hslt-status" --json 2>/dev/null | grep -q '"progress":\(0\.[4-9]\|1\.\)'
}
while kill -0 $submit 2>/dev/null && ! half_done; do
	sleep 0.2
done
echo
"$bin/hslt-status"
wait $submit
"$bin/hslt-tonemap" "$out/demo.exr" "$out/demo.png"
echo "done in $(($(date +%s) - begin)) s: $out/demo.png (to look at), $out/demo.exr (linear light)"
