# SPDX-License-Identifier: Apache-2.0
# A disk that is smaller than the limits of journals and scene files: checkpoints replace journals early, and files of no job are deleted.
if [ -z "${HSLT_OWN_MOUNTS:-}" ]; then
	if ! unshare -rm true 2>/dev/null; then
		echo "skipped: no name spaces for mounts here"
		exit 77
	fi
	HSLT_OWN_MOUNTS=1 exec unshare -rm sh "$0" "$@"
fi
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-job hslt-compare hslt-render

JOB="--integrator path --size 64x64 --epoch 1 --spp 192"
mkdir "$DIR/spool"
mount -t tmpfs -o size=16m none "$DIR/spool" || skip "no tmpfs"
start_coordinator -v
start_worker w

# scene NAME: 5 MB of it are a comment
scene() {
	{
		cat "$BOX"
		awk -v name="$1" 'BEGIN { for (i = 0; i < 100000; i++) printf "<!-- %s, line %06d: what nobody reads -->\n", name, i }'
	} >"$DIR/$1.xml"
}

# Files of jobs that are over: the spool has room for three at most, --blobs allows 100 GB.
for k in one two three four five six; do
	scene $k
	id=$(submit "$DIR/$k.xml" --path "$(dirname "$BOX")" -o "$DIR/none.exr" --integrator path --spp 1) ||
		fail "scene $k is refused: $(tail -n 1 "$DIR/submit.log")"
	"$BIN/hslt-job" cancel "$id" >/dev/null 2>&1 || :
done

# Its results, 20 MB, fit neither beside those files nor into one journal.
id=$(submit "$BOX" -o "$DIR/farm.exr" $JOB)
until_true 60 is_state "$id" done || fail "$id is $(value "$id" state): $(value "$id" waiting); $(df -k "$DIR/spool" | tail -n 1)"
grep -q "event=checkpoint job=$id " "$DIR/coordinator.log" || fail "there was no checkpoint: the disk is too large for this test"
"$BIN/hslt-job" fetch "$id" -o "$DIR/farm.exr" 2>/dev/null
"$BIN/hslt-render" "$BOX" -o "$DIR/render.exr" $JOB 2>/dev/null
same "$DIR/farm.exr" "$DIR/render.exr"
echo "$(grep -c 'event=batch_merged' "$DIR/coordinator.log") results through 16 MB"
