# SPDX-License-Identifier: Apache-2.0
# A worker's cache is removed while it runs, as by a user who empties ~/.cache: it is created again, and jobs go on.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-compare

JOB="--integrator path --size 32x32 --spp 16"
start_coordinator
start_worker w
id=$(submit "$BOX" -o "$DIR/before.exr" $JOB)
until_true 30 is_state "$id" done || fail "$id is $(value "$id" state)"
for kind in slot all; do
	[ $kind = all ] && rm -r "$DIR/cache" || rm -r "$DIR/cache/slot-0"
	id=$(submit "$BOX" -o "$DIR/$kind.exr" $JOB)
	until_true 30 is_state "$id" done || fail "without its cache ($kind): $(value "$id" waiting)"
	[ -n "$(ls "$DIR/cache/slot-0")" ] || fail "nothing is in the cache"
done
[ "$(grep -c 'the cache was removed: it is made anew' "$DIR/w.log")" -eq 2 ] || fail "the worker does not say what happened"

# The worker still owns its place in the cache: another worker takes the next one.
start_worker second
until_true 10 test -d "$DIR/cache/slot-1" || fail "two workers use one slot"
stop $WORKER
echo "the cache is made again"
