# The same bits for 1, 2 and 4 workers as from hslt-render, for samples and for chains.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-render hslt-compare

CHAINS="--bootstrap 20000 --mutations 60000"
"$BIN/hslt-render" "$BOX" -o "$DIR/path.exr" --integrator path --spp 16 2>"$DIR/render.log"
"$BIN/hslt-render" "$BOX" -o "$DIR/pssmlt.exr" --integrator pssmlt $CHAINS 2>>"$DIR/render.log"

start_coordinator
started=0
for workers in 1 2 4; do
	while [ $started -lt $workers ]; do
		started=$((started + 1))
		start_worker "w$started"
	done
	until_true 10 sh -c "[ \$('$BIN/hslt-status' --json | grep -o '\"fingerprint\"' | wc -l) -eq $workers ]" ||
		fail "$workers workers do not show"
	submit "$BOX" -o "$DIR/path-$workers.exr" --integrator path --spp 16 --wait >"$DIR/id"
	same "$DIR/path.exr" "$DIR/path-$workers.exr"
	submit "$BOX" -o "$DIR/pssmlt-$workers.exr" --integrator pssmlt $CHAINS --wait >"$DIR/id"
	same "$DIR/pssmlt.exr" "$DIR/pssmlt-$workers.exr"
done
"$BIN/hslt-compare" --exact "$DIR/path.exr" "$DIR/pssmlt.exr" >/dev/null 2>&1 && fail "path and pssmlt cannot be equal"
echo "equal bits for 1, 2 and 4 workers and hslt-render"
