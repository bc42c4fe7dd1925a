# Two jobs at once: the one of higher priority ends first, and both have the bits that they have alone. Only files that the
# spool misses travel.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-compare

LOW="--integrator pssmlt --bootstrap 20000 --mutations 200000"
HIGH="--integrator path --spp 64 --priority 5 -D light=3"
start_coordinator -v
start_worker w1
low=$(submit "$BOX" -o "$DIR/low.exr" $LOW)
until_true 10 is_state "$low" running || fail "$low does not run"
high=$(submit "$BOX" -o "$DIR/high.exr" $HIGH)
until_true 20 is_state "$high" done || fail "$high is $(value "$high" state)"
"$BIN/hslt-job" fetch "$low" --preview -o "$DIR/preview.exr" || fail "no preview"
head -c 4 "$DIR/preview.exr" | od -An -tx1 | grep -q '76 2f 31 01' || fail "the preview is no EXR"
is_state "$low" running || fail "$low ended before $high, which has priority"
until_true 30 is_state "$low" done || fail "$low is $(value "$low" state)"
"$BIN/hslt-job" fetch "$low" -o "$DIR/low.exr"
"$BIN/hslt-job" fetch "$high" -o "$DIR/high.exr"
submit "$BOX" -o "$DIR/low-alone.exr" $LOW --wait >/dev/null
submit "$BOX" -o "$DIR/high-alone.exr" $HIGH --wait >/dev/null
same "$DIR/low.exr" "$DIR/low-alone.exr"
same "$DIR/high.exr" "$DIR/high-alone.exr"
[ "$(grep -c event=blob_stored "$DIR/coordinator.log")" -eq 2 ] || fail "the scene has 2 files, and they were sent more than once"
"$BIN/hslt-job" list | grep -q "^$high  *done  *5 " || fail "the list does not show the priority"
echo "two jobs at once"
