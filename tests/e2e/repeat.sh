# SPDX-License-Identifier: Apache-2.0
# A worker that sends every result twice: each is merged once.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-compare

JOB="--integrator path --spp 16"
start_coordinator --keep-partials "$DIR/partials"
start_worker once
submit "$BOX" -o "$DIR/once.exr" $JOB --wait >/dev/null
tiles=$(ls "$DIR/partials" | wc -l)
[ "$tiles" -gt 0 ] || fail "no partial tiles were kept"
head -c 4 "$DIR/partials/$(ls "$DIR/partials" | head -n 1)" | od -An -tx1 | grep -q '76 2f 31 01' || fail "a tile is no EXR"
stop $WORKER
start_faulty_worker twice repeat
id=$(submit "$BOX" -o "$DIR/twice.exr" $JOB --wait)
same "$DIR/once.exr" "$DIR/twice.exr"
[ "$(value "$id" repeats)" -gt 0 ] || [ "$(value "$id" refused)" -gt 0 ] || fail "nothing was repeated"
grep -q 'event=batch_repeated' "$DIR/coordinator.log" || fail "no repeat in the log"
[ "$(ls "$DIR/partials" | wc -l)" -eq $((2 * tiles)) ] || fail "a repeated tile was written down, too"
# The image goes to stdout, and the id does not.
"$BIN/hslt-submit" "$BOX" -o - $JOB --wait >"$DIR/stdout.exr" 2>"$DIR/err.log" || fail "-o - ended with $?: $(cat "$DIR/err.log")"
same "$DIR/once.exr" "$DIR/stdout.exr"
grep -q '^j[0-9]*$' "$DIR/err.log" || fail "-o - does not say the id: $(cat "$DIR/err.log")"
code 2 "$BIN/hslt-submit" "$BOX" -o - $JOB
code 2 "$BIN/hslt-submit" "$BOX" -o - $JOB --wait --json
echo "every result twice, merged once"
