# SPDX-License-Identifier: Apache-2.0
# A disk smaller than the limits on journals and scene files: checkpoints replace journals early, files that no job
# needs are deleted, and jobs that do not fit together wait for each other.
OWN_MOUNTS=needed
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-job hslt-compare hslt-render

JOB="--integrator path --size 64x64 --epoch 1 --spp 192"
mkdir "$DIR/spool"
mount -t tmpfs -o size=16m none "$DIR/spool" || skip "no tmpfs"
start_coordinator -v
start_worker w

# scene NAME: writes a scene that contains a comment of 5 MB
scene() {
	{
		cat "$BOX"
		awk -v name="$1" 'BEGIN { for (i = 0; i < 100000; i++) printf "<!-- %s, line %06d: what nobody reads -->\n", name, i }'
	} >"$DIR/$1.xml"
}

# Files of ended jobs: the spool has room for three at most, though --blobs allows 100 GB.
for k in one two three four five six; do
	scene $k
	id=$(submit "$DIR/$k.xml" --path "$(dirname "$BOX")" -o "$DIR/none.exr" --integrator path --spp 1) ||
		fail "scene $k is refused: $(tail -n 1 "$DIR/submit.log")"
	"$BIN/hslt-job" cancel "$id" >/dev/null 2>&1 || :
done

# This job's results, 20 MB, fit neither beside those files nor into one journal.
id=$(submit "$BOX" -o "$DIR/farm.exr" $JOB)
until_true 60 is_state "$id" done || fail "$id is $(value "$id" state): $(value "$id" waiting); $(df -k "$DIR/spool" | tail -n 1)"
grep -q "event=checkpoint job=$id " "$DIR/coordinator.log" || fail "there was no checkpoint: the disk is too large for this test"
"$BIN/hslt-job" fetch "$id" -o "$DIR/farm.exr" 2>/dev/null
"$BIN/hslt-render" "$BOX" -o "$DIR/render.exr" $JOB 2>/dev/null
same "$DIR/farm.exr" "$DIR/render.exr"
echo "$(grep -c 'event=batch_merged' "$DIR/coordinator.log") results through 16 MB"

# Several jobs that each fit alone, but not together: some wait until earlier ones have ended.
mount -o remount,size=$(($(df --output=used -k "$DIR/spool" | tail -n 1) + 14000))k "$DIR/spool"
ids=
for k in 1 2 3 4; do
	ids="$ids $(submit "$BOX" -o "$DIR/none.exr" $JOB --seed $k)"
done
waited=
for id in $ids; do
	until is_state "$id" done; do
		waited="$waited$(for other in $ids; do value "$other" waiting; done | grep 'besides those of j' || :)"
		[ $((looks = ${looks:-0} + 1)) -lt 300 ] || fail "$(for other in $ids; do echo "$other $(value "$other" state): $(value "$other" waiting)"; done)"
		sleep 0.2
	done
done
[ -n "$waited" ] || fail "no job waited for another one: the disk is too large for this test"
