# SPDX-License-Identifier: Apache-2.0
# A scene that no worker can build (one of its files is larger than their caches) fails its job once, with one, two and
# four workers, and the submitter gets a worker's reason: from --wait, the status, the log. If one of three workers can
# build it, it is rendered. The farms run at the same time, because most of the test is pauses.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-job
SCENE=$DIR/box
mkdir -p "$SCENE" && cp -r "$(dirname "$BOX")"/* "$SCENE"
awk 'BEGIN { for (i = 0; i < 30000; i++) print "# a mesh that is too large for a small cache" }' >>"$SCENE/meshes/wedge.obj"
WHY='a file of [0-9]* bytes exceeds its limit'
JOB="--integrator path --spp 4"

# farm NAME WORKERS: starts workers whose caches are too small; the processes are in PIDS
farm() {
	DIR=$DIR/$1
	PIDS=
	trap 'kill -9 $PIDS 2>/dev/null || :' EXIT
	mkdir "$DIR"
	export HSLT_STATUS_SOCKET="$DIR/status"
	start_coordinator
	for n in $(seq "$2"); do
		start_worker "small$n" --threads 2 --cache-size 0.001
	done
}

none() {
	farm "none$1" "$1"
	code=0
	id=$("$BIN/hslt-submit" "$SCENE/box.xml" -o "$DIR/none.exr" $JOB --wait 2>"$DIR/wait.log") || code=$?
	[ $code -eq 3 ] || fail "with $1 workers: hslt-submit ended with $code: $(tail -n 2 "$DIR/wait.log")"
	grep -q "ended without an image: small[0-9]*: .*$WHY" "$DIR/wait.log" || fail "it says: $(tail -n 2 "$DIR/wait.log")"
	is_state "$id" failed || fail "$id is $(value "$id" state)"
	"$BIN/hslt-status" --json "$id" | grep -q "\"why\":\"small[0-9]*: .*$WHY" || fail "the status does not say why"
	"$BIN/hslt-job" log "$id" >"$DIR/log"
	[ "$(grep -c event=job_failed "$DIR/log")" -eq 1 ] || fail "$id failed $(grep -c event=job_failed "$DIR/log") times"
	grep -q "event=lease_failed .*worker=\"small.*$WHY" "$DIR/log" || fail "the log does not say what a worker said"
}

one() {
	farm one 2
	start_worker large
	id=$(submit "$SCENE/box.xml" -o "$DIR/some.exr" $JOB --wait) || fail "one of three can build it: $(cat "$DIR/submit.log")"
	[ -s "$DIR/some.exr" ] || fail "no image"
	"$BIN/hslt-status" | grep -q quarantined && fail "who cannot build a scene is no liar"
	:
}

runs=
for n in 1 2 4; do
	(none $n) &
	runs="$runs $!"
done
(one) &
runs="$runs $!"
PIDS=$runs
for p in $runs; do
	wait "$p" || fail "see above"
done
echo "a job that no worker can build fails once, and says what a worker said"
