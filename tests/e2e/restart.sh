# SPDX-License-Identifier: Apache-2.0
# The coordinator is killed with -9 again and again, in the bootstrap, between rounds and just after an acknowledgement,
# while a job of chains, one of samples and one with a target error run: all continue where they were, no result counts
# twice, and the bits are those of undisturbed runs. SEED=N repeats the moments of a run, KILLS=N sets their number.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-job hslt-compare

SEED=${SEED:-7}
KILLS=${KILLS:-9}
CHAINS="--integrator hslt --bootstrap 100000 --mutations 5000000"
SAMPLES="--integrator path --spp 500"
TARGET="--integrator path --spp 1200 --target-error 6%" # estimates the error on the way
JOURNAL=0.5 # MB: some kills come while there is a checkpoint, some while there is only a journal
echo "seed $SEED"

moment() {
	SEED=$(((SEED * 1103515245 + 12345) % 2147483648))
	awk -v r=$SEED -v least="$1" -v most="$2" 'BEGIN { printf "%.3f\n", least + (most - least) * r / 2147483648 }'
}

again() {
	kill -9 $COORDINATOR_PID
	wait $COORDINATOR_PID 2>/dev/null || :
	LISTEN=$COORDINATOR start_coordinator -v --keep-films 0 --journal $JOURNAL
	killed=$((killed + 1))
}

# waits until a checkpoint is being written, or for a moment at most
writing() {
	tries=400000
	while [ $tries -gt 0 ] && ! [ -e "$DIR/spool/jobs/$a/checkpoint.tmp" ] && ! [ -e "$DIR/spool/jobs/$b/checkpoint.tmp" ]; do
		tries=$((tries - 1))
	done
	[ $tries -eq 0 ] || caught=$((caught + 1))
}

is_merging() {
	[ "$(tail -n +"$seen" "$DIR/coordinator.log" | grep -c event=batch_merged)" -ge "$1" ] || is_state "$a" done
}

# leases that are merged, and leases that were acknowledged in all runs
merged() {
	value "$1" merged
}
acknowledged() {
	grep -c "event=batch_stored job=$1 .* kind=render " "$DIR/coordinator.log" || :
}

start_coordinator -v --keep-films 0
start_worker w1
start_worker w2
submit "$BOX" -o "$DIR/chains-quiet.exr" $CHAINS --wait >/dev/null
submit "$BOX" -o "$DIR/samples-quiet.exr" $SAMPLES --wait >/dev/null
submit "$BOX" -o "$DIR/target-quiet.exr" $TARGET --wait >/dev/null
[ "$(value j3 reason)" = error ] || fail "j3 ended by $(value j3 reason)"
quiet=$(merged j1)
[ "$(acknowledged j1)" -eq "$quiet" ] || fail "$(acknowledged j1) of $quiet were acknowledged"

killed=0
caught=0
a=$(submit "$BOX" -o "$DIR/chains.exr" $CHAINS)
b=$(submit "$BOX" -o "$DIR/samples.exr" $SAMPLES)
c=$(submit "$BOX" -o "$DIR/target.exr" $TARGET)
again # before anything is merged, or in the bootstrap
until_true 20 is_state "$a" bootstrap || is_state "$a" running || fail "$a is $(value "$a" state)"
again
while [ $killed -lt "$KILLS" ]; do
	seen=$(wc -l <"$DIR/coordinator.log")
	until_true 20 is_merging $((killed % 3 * 10 + 1)) || fail "nothing is merged after $killed kills"
	case $((killed % 3)) in # 1: just after a merge
	0) sleep "$(moment 0.05 $((killed / 3)))" ;;
	2) [ $killed -lt 4 ] || writing ;;
	esac
	if is_state "$a" done && is_state "$b" done; then
		break
	fi
	again
	for j in $a $b $c; do
		least=$(acknowledged "$j") # read first, because both numbers grow
		known=$(merged "$j")
		[ "$known" -ge "$least" ] || fail "$j knows $known leases, and $least were acknowledged"
	done
done
[ $killed -ge 5 ] || fail "both jobs were done after $killed kills"
until_true 60 is_state "$a" done || fail "$a is $(value "$a" state)"
until_true 60 is_state "$b" done || fail "$b is $(value "$b" state)"
until_true 60 is_state "$c" done || fail "$c is $(value "$c" state)"
"$BIN/hslt-job" fetch "$a" -o "$DIR/chains.exr"
"$BIN/hslt-job" fetch "$b" -o "$DIR/samples.exr"
"$BIN/hslt-job" fetch "$c" -o "$DIR/target.exr"
same "$DIR/chains-quiet.exr" "$DIR/chains.exr"
same "$DIR/samples-quiet.exr" "$DIR/samples.exr"
same "$DIR/target-quiet.exr" "$DIR/target.exr"
[ "$(merged "$a")" = "$quiet" ] || fail "$(merged "$a") leases were merged, and $quiet without kills"
"$BIN/hslt-job" log "$a" | grep -q 'state=restored .*checkpoint=[1-9]' || fail "$a never went on from a checkpoint"
[ "$(find "$DIR/spool/jobs" -name 'journal.*' -o -name checkpoint | wc -l)" -eq 0 ] || fail "journals of ended jobs are left"
new=$(submit "$BOX" -o "$DIR/new.exr" --integrator path --spp 1)
[ "$new" = j7 ] || fail "the next job is $new, not j7"

# Stored data is damaged: the job says so, begins anew, and the bits are the same.
d=$(submit "$BOX" -o "$DIR/damaged.exr" $SAMPLES)
until_true 20 test -e "$DIR/spool/jobs/$d/checkpoint" || fail "no checkpoint of $d"
kill -9 $COORDINATOR_PID
wait $COORDINATOR_PID 2>/dev/null || :
printf x | dd of="$DIR/spool/jobs/$d/checkpoint" bs=1 seek=5000 conv=notrunc 2>/dev/null
LISTEN=$COORDINATOR start_coordinator -v --keep-films 0 --journal $JOURNAL
"$BIN/hslt-job" log "$d" | grep -q 'event=spool_fault .*damaged' || fail "$d does not say that it is damaged"
until_true 60 is_state "$d" done || fail "$d is $(value "$d" state)"
"$BIN/hslt-job" fetch "$d" -o "$DIR/damaged.exr"
same "$DIR/samples-quiet.exr" "$DIR/damaged.exr"
echo "$killed kills ($caught while a checkpoint was written), $quiet leases, none lost, none twice, bits equal"
