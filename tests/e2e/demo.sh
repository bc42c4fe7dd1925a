# SPDX-License-Identifier: Apache-2.0
# The demo at a small size: it succeeds and leaves only its two pictures; when interrupted it stops all that it started.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-tonemap
DEMO=$HERE/../../deploy/demo-run.sh
case $BUILD in /*) ;; *) BUILD=$PWD/$BUILD ;; esac
mkdir "$DIR/tmp"
export TMPDIR="$DIR/tmp"

# No process of the demo is left: their command lines contain its folders (grep's own does not). A slow process takes a
# moment to end after it was killed.
printf '%s\n' "$DIR/tmp/hslt-demo" "$DIR/out/demo.exr" >"$DIR/marks"
nobody_left() {
	! grep -alF -f "$DIR/marks" /proc/[0-9]*/cmdline 2>/dev/null | grep -q .
}

timeout 600 sh "$DEMO" "$BUILD" "$DIR/out" --size 96x54 -D spp=1 >"$DIR/demo.out" 2>"$DIR/demo.log" || fail "the demo ended with $?"
[ "$(ls "$DIR/out" | tr '\n' ' ')" = "demo.exr demo.png " ] || fail "it left: $(ls "$DIR/out")"
[ "$(od -An -tx1 -j16 -N8 "$DIR/out/demo.png" | tr -d ' ')" = 0000006000000036 ] || fail "the picture is not 96x54"
grep -q '^worker2 ' "$DIR/demo.out" || fail "the farm's state is not shown: $(cat "$DIR/demo.out")"
tail -n 1 "$DIR/demo.out" | grep -q 'out/demo.png' || fail "it does not say where the picture is"
[ -z "$(ls "$TMPDIR")" ] || fail "it left $(ls "$TMPDIR")"
until_true 5 nobody_left || fail "it left somebody running"

# A log of its own: the first demo's log says that it is running until the shell in the background has emptied it.
sh "$DEMO" "$BUILD" "$DIR/out" --size 96x54 -D spp=1000000 >"$DIR/long.out" 2>"$DIR/long.log" &
demo=$!
PIDS="$PIDS $demo"
until_true 20 grep -qs 'running' "$DIR/long.log" || fail "the long demo does not run"
nobody_left && fail "nobody is there to be stopped"
stop $demo
[ $CODE -eq 130 ] || fail "interrupted, it ended with $CODE"
[ -z "$(ls "$TMPDIR")" ] || fail "interrupted, it left $(ls "$TMPDIR")"
until_true 5 nobody_left || fail "interrupted, it left somebody running"

if timeout 600 sh "$DEMO" "$BUILD" "$DIR/out" --no-such-option >"$DIR/demo.out" 2>"$DIR/demo.log"; then
	fail "a demo that cannot be submitted ended with 0"
fi
until_true 5 nobody_left || fail "failed, it left somebody running"
echo "demo: pictures, and nobody left"
