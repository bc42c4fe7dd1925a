# SPDX-License-Identifier: Apache-2.0
# Another program fills the disk while jobs run that had room when they began: jobs that end at a time, at an error, at
# a number of samples, and an extended one. They wait, and say for what; none of their results is lost; they continue
# when there is room, and their images have the bits of an undisturbed run.
OWN_MOUNTS=needed
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-job hslt-compare hslt-render

PATHS="--integrator path --size 64x64 --epoch 1"
mkdir "$DIR/spool"
mount -t tmpfs -o size=48m none "$DIR/spool" || skip "no tmpfs"
start_coordinator -v
start_worker w

# fill_but KB: fills the disk except for so many KB
fill_but() {
	left=$(df --output=avail -k "$DIR/spool" | tail -n 1)
	if [ "$left" -gt "$1" ]; then
		dd if=/dev/zero of="$DIR/spool/somebody-elses" bs=1k count=$((left - $1)) oflag=append conv=notrunc 2>"$DIR/dd.log" || :
	else
		truncate -s "-$(($1 - left))K" "$DIR/spool/somebody-elses"
	fi
}

waits_for_room() {
	fill_but 0
	value "$1" waiting | grep -q "No space left\|space left on the disk\|has no room"
}

has_merged() {
	[ "$(grep -c "event=batch_merged job=$1 " "$DIR/coordinator.log")" -ge "$2" ]
}

finished=$(submit "$BOX" -o "$DIR/short.exr" $PATHS --spp 2 --wait) || fail "a job of two samples per pixel"
exact=$(submit "$BOX" -o "$DIR/exact.exr" $PATHS --target-error 1.5%)
until_true 60 has_merged "$exact" 20 || fail "$exact does not begin"
counted=$(submit "$BOX" -o "$DIR/counted.exr" $PATHS --spp 768)
until_true 60 has_merged "$counted" 20 || fail "$counted does not begin"
timed=$(submit "$BOX" -o "$DIR/timed.exr" $PATHS --time 15)
until_true 60 has_merged "$timed" 20 || fail "$timed does not begin"

# The job waits, none has failed, and the coordinator keeps answering.
until_true 60 waits_for_room "$timed" || fail "$timed does not wait for room: $(value "$timed" state): $(value "$timed" waiting); $(df -k "$DIR/spool" | tail -n 1)"
code 0 timeout 60 "$BIN/hslt-job" list
got=0
timeout 60 "$BIN/hslt-job" extend "$finished" --spp +2 >"$DIR/extend.log" 2>&1 || got=$?
[ $got -ne 124 ] || fail "hslt-job extend gets no answer on a full disk"
[ $got -eq 0 ] || grep -q "No space left\|space left on the disk\|no room\|deleted\|disk is full\|database or disk is full" "$DIR/extend.log" || fail "extend says: $(cat "$DIR/extend.log")"
extended=$([ $got -eq 0 ] && echo yes || echo no)
got=0
timeout 60 "$BIN/hslt-job" extend "$counted" --spp +64 >"$DIR/extend2.log" 2>&1 || got=$?
[ $got -ne 124 ] || fail "hslt-job extend of a running job gets no answer on a full disk"
total=$([ $got -eq 0 ] && echo 832 || echo 768)

# A restart in that state neither refuses nor loses anything.
kill -9 $COORDINATOR_PID
wait $COORDINATOR_PID 2>/dev/null || :
LISTEN=$COORDINATOR start_coordinator -v
for id in $timed $exact $counted; do
	case $(value "$id" state) in failed | cancelled | "") fail "$id is '$(value "$id" state)' after a restart: $(value "$id" why)" ;; esac
done
rm "$DIR/spool/somebody-elses"
for id in $timed $exact $counted; do
	until_true 120 is_state "$id" done || fail "$id is $(value "$id" state): $(value "$id" waiting) $(value "$id" why); $(df -k "$DIR/spool" | tail -n 1)"
	"$BIN/hslt-job" fetch "$id" -o "$DIR/$id.exr" 2>/dev/null || fail "no image of $id"
done
"$BIN/hslt-render" "$BOX" -o "$DIR/render.exr" $PATHS --spp $total 2>/dev/null
same "$DIR/$counted.exr" "$DIR/render.exr"
for id in $timed $exact; do # the header has options that give the same bits
	options=$(strings -n 8 "$DIR/$id.exr" | sed -n 's/hslt:.*//; /^--integrator /p' | head -n 1)
	"$BIN/hslt-render" "$BOX" -o "$DIR/$id-again.exr" $options 2>/dev/null || fail "hslt-render $options"
	same "$DIR/$id.exr" "$DIR/$id-again.exr"
done
echo "jobs waited on a full disk and went on; extend of a finished job while it was full: $extended, of a running one: $total samples per pixel"
