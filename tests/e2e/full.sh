# SPDX-License-Identifier: Apache-2.0
# A spool without room: the coordinator acknowledges nothing that is not stored, holds the job with the reason, takes no
# new one, and keeps answering. With room again the job continues by itself, to the same bits. Cancelling a job needs no
# room.
OWN_MOUNTS=needed
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-job hslt-compare

# is_merged JOB N: more than N results are merged
is_merged() {
	[ "$(value "$1" merged)" -gt "$2" ]
}

JOB="--integrator hslt --bootstrap 20000 --mutations 2000000"
mkdir "$DIR/spool"
mount -t tmpfs -o size=32m none "$DIR/spool" || skip "no tmpfs"
start_coordinator -v --keep-films 0
start_worker w1
submit "$BOX" -o "$DIR/quiet.exr" $JOB --wait >/dev/null
quiet=$(value j1 merged)

# A job that would not fit even on the empty disk is refused, and delays nobody.
code 6 "$BIN/hslt-submit" "$BOX" -o "$DIR/large.exr" --integrator hslt --size 640x360 --spp 16
grep -q "it may need .* MB for its files and films, and the disk of the coordinator's spool has 33.6 MB in all" "$DIR/err.log" ||
	fail "the refusal does not say why: $(tail -n 1 "$DIR/err.log")"

head -c 3000000 /dev/zero >"$DIR/spool/ballast" # the films need a disk of 4,700 KB
used=$(df --output=used -k "$DIR/spool" | tail -n 1)
mount -o remount,size=$((used + 4900))k "$DIR/spool" # all results take 5,000 KB, and so would a checkpoint
id=$(submit "$BOX" -o "$DIR/full.exr" $JOB)
until_true 20 is_state "$id" held || fail "$id is $(value "$id" state), and $(df -k "$DIR/spool" | tail -n 1)"
value "$id" waiting | grep -q 'No space left\|space left on the disk' || fail "it does not say why: $(value "$id" waiting)"
grep -q "level=warn event=job_held job=$id state=held" "$DIR/coordinator.log" || fail "the log does not warn"
[ -z "$(value "$id" eta | grep -v null)" ] || fail "it states when it will be done: $(value "$id" eta)"
before=$(value "$id" merged)
first=$before
[ "$first" -lt "$quiet" ] || fail "there was room for all"
head -c 20000000 /dev/zero >"$DIR/spool/filler" 2>/dev/null && fail "there is room"
if submit "$BOX" -o "$DIR/none.exr" $JOB >/dev/null; then
	fail "another job was taken"
fi
tail -n 1 "$DIR/submit.log" | grep -q 'No space left\|full' || fail "the refusal does not say why: $(tail -n 1 "$DIR/submit.log")"
rm "$DIR/spool/filler"
is_state "$id" held || fail "$id is $(value "$id" state)"
mount -o remount,size=64m "$DIR/spool"
until_true 30 is_state "$id" done || fail "$id is $(value "$id" state)"
"$BIN/hslt-job" fetch "$id" -o "$DIR/full.exr"
same "$DIR/quiet.exr" "$DIR/full.exr"
[ "$(value "$id" merged)" = "$quiet" ] || fail "$(value "$id" merged) leases, not $quiet"

used=$(df --output=used -k "$DIR/spool" | tail -n 1)
mount -o remount,size=$((used + 3000))k "$DIR/spool"
# A job is also refused if no other job's end would make room for it: free space plus that of files and jobs is too small.
# shellcheck disable=SC2086
code 6 "$BIN/hslt-submit" "$BOX" -o "$DIR/gone.exr" $JOB
grep -q 'it may need [0-9]* bytes for .* spool has [0-9]*: [0-9]* are free, [0-9]* belong' "$DIR/err.log" ||
	fail "the refusal does not say why: $(tail -n 1 "$DIR/err.log")"
mount -o remount,size=$((used + 4900))k "$DIR/spool"
id=$(submit "$BOX" -o "$DIR/gone.exr" $JOB)
until_true 20 is_state "$id" held || fail "$id is $(value "$id" state)"
"$BIN/hslt-job" cancel "$id"
kill -9 $COORDINATOR_PID
wait $COORDINATOR_PID 2>/dev/null || :
LISTEN=$COORDINATOR start_coordinator -v --keep-films 0
is_state "$id" cancelled || fail "$id is $(value "$id" state) after it was cancelled"

# Data that no job needs is deleted for a new job: the films of the first one, which are kept for hslt-job extend.
stop $COORDINATOR_PID
mount -o remount,size=64m "$DIR/spool"
LISTEN=$COORDINATOR start_coordinator -v
kept=$(submit "$BOX" -o "$DIR/kept.exr" $JOB)
until_true 30 is_state "$kept" done || fail "$kept is $(value "$kept" state)"
[ -n "$(find "$DIR/spool/jobs/$kept" -name 'journal.*' -size +1000k -o -name checkpoint -size +1000k)" ] || fail "no films are kept"
{
	cat "$BOX"
	awk 'BEGIN { for (i = 0; i < 20000; i++) printf "<!-- line %06d: what nobody reads -->\n", i }'
} >"$DIR/long.xml"
head -c 99000000 /dev/zero >"$DIR/spool/filler" 2>/dev/null && fail "there is room"
id=$(submit "$DIR/long.xml" --path "$(dirname "$BOX")" -o "$DIR/long.exr" --integrator path --spp 1) ||
	fail "refused while films could be deleted: $(tail -n 1 "$DIR/submit.log")"
until_true 30 is_state "$id" done || fail "$id is $(value "$id" state): $(value "$id" waiting)"
rm "$DIR/spool/filler"

# A job that waits for room gets the room of a scene that no job needs any more.
head -c 3000000 /dev/zero >>"$DIR/spool/ballast"
holder=$(submit "$DIR/long.xml" --path "$(dirname "$BOX")" -o "$DIR/long.exr" $JOB)
"$BIN/hslt-job" hold "$holder" 2>/dev/null
mount -o remount,size=$(($(df --output=used -k "$DIR/spool" | tail -n 1) + 4000))k "$DIR/spool"
id=$(submit "$BOX" -o "$DIR/gone.exr" $JOB)
until_true 20 is_state "$id" held || fail "$id is $(value "$id" state)"
head -c 20000000 /dev/zero >"$DIR/spool/filler" 2>/dev/null && fail "there is room"
sleep 3
before=$(value "$id" merged)
"$BIN/hslt-job" cancel "$holder" || fail "$holder cannot be cancelled: it has no results that could be deleted"
until_true 20 is_merged "$id" "$before" || fail "$id stays at $before results: $(value "$id" waiting)"
kill -9 $COORDINATOR_PID
wait $COORDINATOR_PID 2>/dev/null || :
LISTEN=$COORDINATOR start_coordinator -v
is_state "$holder" cancelled || fail "$holder is $(value "$holder" state) after it was cancelled"
echo "held at $first of $quiet leases, went on, bits equal"
