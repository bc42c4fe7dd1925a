# SPDX-License-Identifier: Apache-2.0
# Orders to existing jobs: hold, release, priority, extend; and all of them again after kill -9 of the coordinator.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-job hslt-compare

job() {
	"$BIN/hslt-job" "$@"
}

# refused CODE TEXT COMMAND...: checks exit code and message
refused() {
	want=$1
	text=$2
	shift 2
	code=0
	"$@" >"$DIR/said" 2>&1 || code=$?
	[ $code -eq "$want" ] || fail "$*: code $code, not $want"
	grep -q -e "$text" "$DIR/said" || fail "$*: $(cat "$DIR/said")"
}

again() {
	kill -9 $COORDINATOR_PID
	wait $COORDINATOR_PID 2>/dev/null || :
	LISTEN=$COORDINATOR start_coordinator -v --journal 0.2
}

done_in() {
	until_true "$1" is_state "$2" done || fail "$2 is $(value "$2" state): $(value "$2" why)"
}

merged_more() {
	[ "$(value "$1" merged)" -gt "$2" ]
}

has_no_leases() {
	[ "$(value "$1" leases)" -eq 0 ]
}

more_rounds() {
	[ "$(value "$1" rounds)" -gt "$2" ]
}

start_coordinator -v --journal 0.2
start_worker w1

# ---- hold, release, priority
for again in 1 2 3 4 5; do # again if the worker is faster than this script and has done the job
	a=$(submit "$BOX" -o "$DIR/a.exr" --integrator path --spp 500)
	until_true 20 merged_more "$a" 3 || fail "nothing of $a is merged"
	! job hold "$a" 2>>"$DIR/hold.log" || break
done
[ "$(value "$a" state)" = held ] || fail "$a is $(value "$a" state)"
[ "$(value "$a" waiting)" = "held by a client" ] || fail "$a waits: $(value "$a" waiting)"
until_true 20 has_no_leases "$a" || fail "leases of $a are out"
b=$(submit "$BOX" -o "$DIR/b.exr" --integrator path --spp 4)
done_in 30 "$b"
again
[ "$(value "$a" state)" = held ] || fail "$a is $(value "$a" state) after a restart"
c=$(submit "$BOX" -o "$DIR/c.exr" --integrator path --spp 50000 --epoch 4) # neither job ends by itself
d=$(submit "$BOX" -o "$DIR/d.exr" --integrator path --spp 50000 --epoch 4)
job priority "$d" -5
job priority "$c" 7
again
[ "$(value "$c" priority)" = 7 ] && [ "$(value "$d" priority)" = -5 ] || fail "priorities are lost"
before=$(value "$c" merged) # the worker may not be back yet
until_true 30 merged_more "$c" $((before + 5)) || fail "nothing of $c is merged"
[ "$(value "$d" merged)" -eq 0 ] || fail "$d came before $c"
job list >"$DIR/list"
grep -q "^$c .* [01] of 1 .*# by turns with\|^$c .* [01] of 1 [^#]*$" "$DIR/list" || fail "the list says of $c: $(cat "$DIR/list")"
grep -q "^$d .*waits for $c of higher priority (7)\|^$d .*0 of 1 .*# $c comes first" "$DIR/list" || fail "the list says of $d: $(cat "$DIR/list")"
"$BIN/hslt-status" "$c" | grep -q 'priority 7; [01] of 1 machine; 1 due by its priority' || fail "hslt-status says: $("$BIN/hslt-status" "$c")"
job priority "$d" 50
job release "$a"
[ "$(value "$a" state)" != held ] || fail "$a is held still"
until_true 30 merged_more "$d" 5 || fail "nothing of $d is merged"
job log "$d" | grep -q 'event=job_note .*priority=50 by=' || fail "the log of $d does not know its priority"
job log "$a" | grep -q 'state=held by=' || fail "the log of $a does not know that it was held"
job log "$a" | grep -q 'state=released by=' || fail "the log of $a does not know that it was released"
refused 2 'from -100 to 100' job priority "$d" 101
refused 2 'a priority is missing' job priority "$d"
refused 1 'no such job' job hold j99
refused 1 'the job is over' job hold "$b"
refused 1 'the job is over' job cancel "$b"
[ "$(job cancel "$c")" = "$c is cancelled" ] || fail "cancel does not say what it did"
job cancel "$d"
done_in 60 "$a"
submit "$BOX" -o "$DIR/quiet.exr" --integrator path --spp 500 --wait >/dev/null
job fetch "$a" -o "$DIR/a.exr" 2>"$DIR/fetch.log"
[ "$(cat "$DIR/fetch.log")" = "$a: image in $DIR/a.exr" ] || fail "fetch says: $(cat "$DIR/fetch.log")"
same "$DIR/a.exr" "$DIR/quiet.exr"
echo "held, released, put first and last; the bits of a quiet run"

# ---- extend: after the end, after a restart, by an error; the bits of one long job
CHAINS="--integrator hslt --chains 64 --epoch 500 --bootstrap 20000"
submit "$BOX" -o "$DIR/long.exr" $CHAINS --spp 600 --wait >/dev/null
e=$(submit "$BOX" -o "$DIR/extended.exr" $CHAINS --spp 100)
done_in 60 "$e"
job fetch "$e" -o "$DIR/short.exr"
"$BIN/hslt-compare" --exact "$DIR/short.exr" "$DIR/long.exr" >/dev/null 2>&1 && fail "100 and 600 samples a pixel are the same"
echo '<scene/>' >"$DIR/scene.xml"
refused 1 'scene.xml exists and is not an OpenEXR file' job fetch "$e" -o "$DIR/scene.xml"
[ "$(cat "$DIR/scene.xml")" = '<scene/>' ] || fail "fetch has replaced a scene"
refused 2 'the name of a file' job fetch "$e" -o ''
"$BIN/hslt-job" fetch "$e" -o - >"$DIR/stdout.exr" 2>"$DIR/fetch.log" && cmp "$DIR/stdout.exr" "$DIR/short.exr" || fail "fetch -o -: $(cat "$DIR/fetch.log")"
refused 2 'a bound is missing' job extend "$e"
"$BIN/hslt-job" extend "$e" --spp +100 >"$DIR/extend.log" && grep -qE "^$e continues after 1 round, until [0-9]+ are done$|^$e continues after [0-9]+ rounds, until" "$DIR/extend.log" ||
	fail "extend says: $(cat "$DIR/extend.log")"
job fetch "$e" -o "$DIR/between.exr" || fail "the image of before is gone while it goes on"
again # during the extension
done_in 60 "$e"
again # and after its end
first=$(value "$e" rounds)
before=$(value "$e" merged)
refused 2 "such as +8, not .300." job extend "$e" --spp 300
job extend "$e" --spp +300
until_true 60 merged_more "$e" "$before" || fail "nothing more of $e is merged"
job extend "$e" --spp +100 # while it runs at a worker that knows the earlier bound, or just after
until_true 60 more_rounds "$e" "$first" || fail "$e does not go on after $first rounds"
done_in 60 "$e"
job fetch "$e" -o "$DIR/extended.exr"
same "$DIR/extended.exr" "$DIR/long.exr"
job log "$e" | grep -q 'state=extended by=- text="continues after 6 rounds, until 12 are done"' || fail "the log of $e does not say that it went on"

# samples, and until an error is reached
SAMPLES="--integrator path --epoch 4 --bootstrap 16384"
submit "$BOX" -o "$DIR/target.exr" $SAMPLES --target-error 5% --wait >/dev/null
f=$(submit "$BOX" -o "$DIR/tighter.exr" $SAMPLES --target-error 20%)
done_in 60 "$f"
first=$(value "$f" rounds)
refused 1 'already' job extend "$f" --target-error 30%
job log "$f" | grep -q state=restored && fail "its films are read for nothing"
job extend "$f" --target-error 5%
until_true 60 more_rounds "$f" "$first" || fail "$f does not go on after $first rounds"
again
done_in 60 "$f"
[ "$(value "$f" reason)" = error ] || fail "$f ended by $(value "$f" reason)"
job fetch "$f" -o "$DIR/tighter.exr"
same "$DIR/tighter.exr" "$DIR/target.exr"

# faults are counted across restarts and the job's ends
start_faulty_worker twice repeat
until_true 10 grep -q 'event=peer_hello.*name="twice"' "$DIR/coordinator.log" || fail "the second worker does not come"
h=$(submit "$BOX" -o "$DIR/h.exr" --integrator path --spp 500)
repeated() {
	[ "$(value "$1" repeats)" -ge "$2" ]
}
for pause in 0.5 5 20; do # the counts are stored now and then, later on a busy machine
	until_true 60 repeated "$h" 5 || fail "nothing of $h is repeated"
	sleep $pause
	again
	! repeated "$h" 5 || break
done
repeated "$h" 5 || fail "$h had 5 repeats, and after a restart $(value "$h" repeats)"
stop $WORKER
done_in 60 "$h"
count=$(value "$h" repeats)
job extend "$h" --spp +100
repeated "$h" "$count" || fail "$h had $count repeats, and when it goes on $(value "$h" repeats)"
done_in 60 "$h"

# an extension that is cancelled leaves the finished job, also if the coordinator is killed at once
i=$(submit "$BOX" -o "$DIR/i.exr" $CHAINS --spp 100)
done_in 60 "$i"
first=$(value "$i" rounds)
before=$(value "$i" merged)
job extend "$i" --spp +100000
until_true 60 merged_more "$i" "$before" || fail "nothing more of $i is merged"
[ "$(job cancel "$i")" = "the extension of $i is cancelled; its finished image stays" ] || fail "cancel does not say that $i stays"
again
is_state "$i" done || fail "$i is $(value "$i" state) after its extension was cancelled"
[ "$(value "$i" rounds)" = "$first" ] || fail "$i has $(value "$i" rounds) rounds, and its image $first"
job fetch "$i" -o "$DIR/i.exr"
same "$DIR/i.exr" "$DIR/short.exr"
job extend "$i" --spp +100
done_in 60 "$i"
until_true 60 more_rounds "$i" "$first" || fail "$i does not go on after a cancelled extension"

# orders that must be refused
g=$(submit "$BOX" -o "$DIR/g.exr" --integrator path --spp 20000)
job cancel "$g"
refused 1 'has been cancelled, and nothing of it was kept: submit it again' job extend "$g" --spp +8
refused 1 'no such job' job extend j99 --spp +8
rm "$DIR/spool/jobs/$f/checkpoint" "$DIR/spool/jobs/$f"/journal.* 2>/dev/null || :
refused 1 'its films have been deleted: submit it again' job extend "$f" --time +1
is_state "$f" done || fail "$f is $(value "$f" state)"
kill -9 $COORDINATOR_PID
wait $COORDINATOR_PID 2>/dev/null || :
LISTEN=$COORDINATOR start_coordinator -v --keep-films 0.001
refused 1 'its films have been deleted' job extend "$e" --spp +8
[ "$(find "$DIR/spool/jobs" -name 'journal.*' -o -name checkpoint -o -name order | wc -l)" -eq 0 ] || fail "films beyond the limit are kept"
job fetch "$e" -o "$DIR/still.exr"
same "$DIR/still.exr" "$DIR/long.exr"
echo "extended while it ran, when it was done, after restarts, until an error: the bits of one long job"
