# SPDX-License-Identifier: Apache-2.0
# Two jobs at once: the one of higher priority ends first, and both have the bits that they have alone. Only files
# missing in the spool are sent.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-job hslt-compare

LOW="--integrator pssmlt --bootstrap 20000 --mutations 200000"
HIGH="--integrator path --spp 64 --priority 5 -D light=3"
start_coordinator -v
start_worker w1
started() {
	is_state "$low" running || is_state "$low" done
}
for again in 1 2 3 4 5; do # again if the worker is faster than this script and has done the job
	low=$(submit "$BOX" -o "$DIR/low.exr" $LOW)
	until_true 10 started || fail "$low does not run"
	! "$BIN/hslt-job" hold "$low" 2>>"$DIR/hold.log" || break
done
is_state "$low" held || fail "$low is $(value "$low" state)"
high=$(submit "$BOX" -o "$DIR/high.exr" $HIGH)
"$BIN/hslt-job" fetch "$low" --preview -o "$DIR/preview.exr" || fail "no preview"
"$BIN/hslt-job" fetch "$low" --preview -o "$DIR/low.exr" 2>"$DIR/fetch.log" && [ ! -e "$DIR/low.exr" ] && [ -s "$DIR/low.preview.exr" ] ||
	fail "a preview takes the name of the image"
grep -qx "$low: preview, the image so far, in $DIR/low.preview.exr; $DIR/low.exr is for the final image" "$DIR/fetch.log" ||
	fail "a preview under the name of the image: $(cat "$DIR/fetch.log")"
"$BIN/hslt-job" fetch "$low" --preview -o /dev/fd/3 3>"$DIR/through.exr" && [ -s "$DIR/through.exr" ] ||
	fail "a preview through a descriptor is checked like a file"
"$BIN/hslt-job" fetch "$low" --preview -o - 2>"$DIR/fetch.log" | head -c 4 | od -An -tx1 | grep -q '76 2f 31 01' || fail "no preview on stdout"
grep -qx "$low: preview, the image so far, in stdout" "$DIR/fetch.log" || fail "a preview on stdout: $(cat "$DIR/fetch.log")"
! "$BIN/hslt-job" fetch "$low" --preview -o - >/dev/full 2>"$DIR/fetch.log" || fail "a full disk holds a preview"
grep -qx "hslt-job: stdout: No space left on device" "$DIR/fetch.log" || fail "stdout is called: $(cat "$DIR/fetch.log")"
head -c 4 "$DIR/preview.exr" | od -An -tx1 | grep -q '76 2f 31 01' || fail "the preview is no EXR"
"$BIN/hslt-job" release "$low" 2>>"$DIR/hold.log" || fail "$low is $(value "$low" state)"
until_true 20 is_state "$high" done || fail "$high is $(value "$high" state)"
until_true 30 is_state "$low" done || fail "$low is $(value "$low" state)"
[ "$(sed -n 's/.*event=job_done job=\(j[0-9]*\).*/\1/p' "$DIR/coordinator.log" | tail -n 2 | tr '\n' ' ')" = "$high $low " ] ||
	fail "$low ended before $high, which has priority"
"$BIN/hslt-job" fetch "$low" -o "$DIR/low.exr"
"$BIN/hslt-job" fetch "$high" -o "$DIR/high.exr"
submit "$BOX" -o "$DIR/low-alone.exr" $LOW --wait >/dev/null
submit "$BOX" -o "$DIR/high-alone.exr" $HIGH --wait >/dev/null
same "$DIR/low.exr" "$DIR/low-alone.exr"
same "$DIR/high.exr" "$DIR/high-alone.exr"
[ "$(grep -c event=blob_stored "$DIR/coordinator.log")" -eq 2 ] || fail "the scene has 2 files, and they were sent more than once"
"$BIN/hslt-job" list | grep -q "^$high  *done  *5 " || fail "the list does not show the priority"
echo "two jobs at once"
