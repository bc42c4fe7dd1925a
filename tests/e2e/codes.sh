# SPDX-License-Identifier: Apache-2.0
# Exit codes, refused requests, and what survives the coordinator.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-job hslt-ca

for p in coordinator worker submit status job ca; do
	code 0 "$BIN/hslt-$p" --version
	code 0 "$BIN/hslt-$p" --help
	grep -qi example "$DIR/out" || fail "hslt-$p --help has no examples"
	code 2 "$BIN/hslt-$p" --no-such-option
done
# untold WANTED COMMAND...: checks the exit code when stdout is on a full disk
untold() {
	wanted=$1
	shift
	got=0
	"$@" >/dev/full 2>"$DIR/err.log" || got=$?
	[ $got -eq "$wanted" ] || fail "$* on a full disk ended with $got, not $wanted: $(cat "$DIR/err.log")"
}
for p in "$BIN"/hslt-*; do
	untold 1 "$p" --version
done
code 2 "$BIN/hslt-coordinator" --listen 0.0.0.0:0 --spool "$DIR/open"
grep -q -- --insecure "$DIR/err.log" || fail "it does not say how"
[ ! -e "$DIR/open" ] || fail "a spool was created for an address that is refused"
code 2 "$BIN/hslt-worker" --coordinator 192.0.2.1:7700 --cache "$DIR/cache"
code 2 "$BIN/hslt-submit" --coordinator 192.0.2.1:7700 "$BOX" -o "$DIR/a.exr"
code 75 "$BIN/hslt-submit" --coordinator 127.0.0.1:1 "$BOX" -o "$DIR/a.exr"
! grep -q 'chosen by a pilot' "$DIR/err.log" || fail "a pilot before anybody was asked: $(cat "$DIR/err.log")"
code 75 "$BIN/hslt-job" --coordinator 127.0.0.1:1 list
code 75 "$BIN/hslt-status" --socket "$DIR/none"

code 2 "$BIN/hslt-submit" --coordinator 127.0.0.1:1 --tls "$DIR/nofolder" "$BOX" -o "$DIR/a.exr" -i path
code 2 "$BIN/hslt-job" --coordinator 127.0.0.1:1 --tls "$DIR/nofolder" list
code 2 "$BIN/hslt-worker" --coordinator 127.0.0.1:1 --tls "$DIR/nofolder" --cache "$DIR/cache"
# Films that do not fit into memory are refused before the bootstrap. A folder that the worker may not read is no
# refusal by the coordinator, after which nobody would restart the worker.
if (ulimit -v 40000000 && "$BIN/hslt-render" --version) >/dev/null 2>&1; then
	(ulimit -v 40000000 && code 1 "$BIN/hslt-render" "$BOX" -o "$DIR/a.exr" --size 4096x4096 --groups 64 --spp 64 -i path) || exit 1
	grep -q 'no room for the films, [0-9.]* GB: .*--groups' "$DIR/err.log" && ! grep -q '^bootstrap' "$DIR/err.log" ||
		fail "films without room: $(cat "$DIR/err.log")"
else
	skip_part "it cannot run within 40 GB of addresses"
fi
mkdir -m 700 "$DIR/closed"
other=
[ "$(id -u)" != 0 ] || other="setpriv --reuid=65534 --regid=65534 --clear-groups"
[ -n "$other" ] || chmod 0 "$DIR/closed"
if $other "$BIN/hslt-worker" --version >/dev/null 2>&1; then
	code 1 $other "$BIN/hslt-worker" --coordinator 127.0.0.1:1 --cache "$DIR/closed/cache"
	grep -q 'Permission denied' "$DIR/err.log" || fail "a closed cache: $(cat "$DIR/err.log")"
else
	skip_part "no other user here"
fi
chmod 700 "$DIR/closed"

mkdir "$DIR/homeless"
(cd "$DIR/homeless" && unset HOME HSLT_CA && code 2 "$BIN/hslt-ca" init) || exit 1
grep -q -- '--ca DIR' "$DIR/err.log" && [ -z "$(ls -A "$DIR/homeless")" ] || fail "hslt-ca without a home: $(cat "$DIR/err.log")"

start_coordinator
code 1 "$BIN/hslt-coordinator" --listen 127.0.0.1:0 --spool "$DIR/spool" # a spool belongs to one coordinator
code 1 "$BIN/hslt-render" "$BOX" -o "$DIR/no/such/folder.exr" # refused before rendering, not after hours
code 1 "$BIN/hslt-submit" "$BOX" -o "$DIR/no/such/folder.exr" --wait
code 1 "$BIN/hslt-submit" "$DIR/none.xml" -o "$DIR/a.exr"
code 2 "$BIN/hslt-submit" "$BOX" -o "$DIR/a.exr" --crop 0,0,0,0,0
code 2 "$BIN/hslt-assemble" -o "$DIR/a.png" "$DIR/a.exr"
grep -q "hslt-tonemap" "$DIR/err.log" || fail "hslt-assemble -o a.png says: $(cat "$DIR/err.log")"
code 2 "$BIN/hslt-job" --coordinator "$COORDINATOR" fetch j1 -o "$DIR/a.png"
grep -q "hslt-tonemap" "$DIR/err.log" || fail "hslt-job fetch -o a.png says: $(cat "$DIR/err.log")"
code 2 "$BIN/hslt-accuracy" "$BOX" -o "$DIR/a.png"
code 2 "$BIN/hslt-compare" "$DIR/a.exr" "$DIR/b.exr" --heatmap "$DIR/h.exr"
grep -q 'a PNG file is written, so the name should end in .png$' "$DIR/err.log" || fail "hslt-compare --heatmap h.exr says: $(cat "$DIR/err.log")"
code 2 "$BIN/hslt-tonemap" "$DIR/a.exr" "$DIR/a.jpg"
code 2 "$BIN/hslt-render" "$BOX" -o "$DIR/a.exr" --stats "$DIR/s.png"
for p in render submit; do
	code 2 "$BIN/hslt-$p" "$BOX" --estimate --plot "$DIR/cost.jpg"
	code 2 "$BIN/hslt-$p" "$BOX" -o "$DIR/a.png"
	grep -q "hslt-tonemap" "$DIR/err.log" || fail "hslt-$p -o a.png says: $(cat "$DIR/err.log")"
	code 2 "$BIN/hslt-$p" "$BOX" -o "$DIR/a.exr" -i hsl
	grep -q 'did you mean `hslt`' "$DIR/err.log" || fail "hslt-$p -i hsl says: $(cat "$DIR/err.log")"
	code 2 "$BIN/hslt-$p" "$BOX" -o "$DIR/a.exr" --target-error 5
	grep -q "500 %.*did you mean 5%?" "$DIR/err.log" || fail "hslt-$p --target-error 5 says: $(cat "$DIR/err.log")"
	code 2 "$BIN/hslt-$p" "$BOX" -o "$DIR/a.exr" --target-error 150%
	grep -q "150 %.*did you mean 1.5%?" "$DIR/err.log" || fail "hslt-$p --target-error 150% says: $(cat "$DIR/err.log")"
	code 2 "$BIN/hslt-$p" "$BOX" -o "$DIR/a.exr" --mutations independent --integrator pssmlt --mutations 1000
	grep -q "pssmlt has no strategies" "$DIR/err.log" || fail "hslt-$p says: $(cat "$DIR/err.log")"
	code 2 "$BIN/hslt-$p" "$BOX" -o "$DIR/a.exr" --integrator path --mutations hslt=0.9,independent=0.1
	for list in 12x 0 a,,b 'a b' , -1; do
		code 2 "$BIN/hslt-$p" "$BOX" -o "$DIR/a.exr" --mutations "$list"
	done
	for text in tolerance tolerance=2 tolerance=1e-3, =1 precision=half wavelengths=3; do
		code 2 "$BIN/hslt-$p" "$BOX" -o "$DIR/a.exr" --set "$text"
	done
	code 2 "$BIN/hslt-$p" "$BOX" -o "$DIR/a.exr" --set tolerence=1e-3
	grep -q "did you mean .tolerance" "$DIR/err.log" || fail "hslt-$p says: $(cat "$DIR/err.log")"
	for wrong in "--min-depth 9 --max-depth 3" "--crop 1000,0,9,9" "--size 70000x2" "--size 9000x9000" "--groups 65" "--parts 65"; do
		code 2 "$BIN/hslt-$p" "$BOX" -o "$DIR/a.exr" $wrong
		code 2 "$BIN/hslt-$p" "$BOX" -o "$DIR/a.exr" -i path $wrong
		code 2 "$BIN/hslt-$p" --estimate "$BOX" -i path $wrong
	done
	code 2 "$BIN/hslt-$p" "$BOX" -o "$DIR/a.exr" -i path --groups 1 --target-error 5% # it would never end
	grep -q 'a single group of samples gives no error' "$DIR/err.log" || fail "hslt-$p --groups 1: $(cat "$DIR/err.log")"
	# Zero is no request for the default, and a number above the bound is refused with that bound.
	for wrong in "min-depth 0" "max-depth 0" "max-depth 129" "chains 0" "chains 2M" "groups 0" "parts 0" "bootstrap 0" "bootstrap 34M" \
		"epoch 0" "seed 18446744073709551616"; do
		code 2 "$BIN/hslt-$p" "$BOX" -o "$DIR/a.exr" --$wrong
		case $wrong in
		*depth*) bounds="from 1 to 128" ;;
		chains*) bounds="from 1 to 1048576" ;;
		bootstrap*) bounds="from 1 to 33554432" ;;
		epoch*) bounds="of at least 1 and below 2^64" ;;
		seed*) bounds="of at least 0 and below 2^64" ;;
		*) bounds="from 1 to 64" ;;
		esac
		grep -q -F -- "--${wrong% *} takes a whole number $bounds, not '${wrong#* }'" "$DIR/err.log" ||
			fail "hslt-$p --$wrong: $(cat "$DIR/err.log")"
	done
	code 0 "$BIN/hslt-$p" --seed 18446744073709551615 --max-depth 128 --version
	code 2 "$BIN/hslt-$p" "$BOX" -o "$DIR/a.exr" -i path --chains 10
	grep -q -- '--chains 10: the integrator path has no chains' "$DIR/err.log" || fail "hslt-$p: $(cat "$DIR/err.log")"
	code 2 "$BIN/hslt-$p" "$BOX" -o ''
	code 2 "$BIN/hslt-$p" "$BOX" -o "$DIR/a.exr" --size wide
	grep -q -- '--size takes W or WxH, such as 640x360 or 1.5k' "$DIR/err.log" || fail "hslt-$p --size wide: $(cat "$DIR/err.log")"
	code 0 "$BIN/hslt-$p" --set help
	grep -q "^tolerance=0.001 " "$DIR/out" || fail "hslt-$p --set help says: $(cat "$DIR/out")"
done
code 2 "$BIN/hslt-job" extend j1 --target-error 150%
grep -q "150 %.*did you mean 1.5%?" "$DIR/err.log" || fail "hslt-job extend --target-error 150% says: $(cat "$DIR/err.log")"
code 2 "$BIN/hslt-accuracy" "$BOX" -o "$DIR/a.html" --target-error 150%
grep -q "150 %.*did you mean 1.5%?" "$DIR/err.log" || fail "hslt-accuracy --target-error 150% says: $(cat "$DIR/err.log")"
code 1 "$BIN/hslt-job" fetch j1
grep -q '^hslt-job: j1: no such job$' "$DIR/err.log" || fail "hslt-job fetch j1 says: $(cat "$DIR/err.log")"
code 1 "$BIN/hslt-status" j99
grep -q '^hslt-status: j99: no such job$' "$DIR/err.log" || fail "hslt-status j99 says: $(cat "$DIR/err.log")"
code 2 "$BIN/hslt-status" banana
code 2 "$BIN/hslt-status" j
code 1 "$BIN/hslt-job" cancel j1
code 2 "$BIN/hslt-job" cancel j18446744073709551616 # larger than any id
# Options of another verb would otherwise be ignored unnoticed: the log not written to the file, the job cancelled.
code 2 "$BIN/hslt-job" log j1 -o "$DIR/j1.txt"
grep -q -- '--output is only for fetch: the log goes to stdout' "$DIR/err.log" || fail "hslt-job log -o says: $(cat "$DIR/err.log")"
code 2 "$BIN/hslt-job" cancel j1 --preview
code 2 "$BIN/hslt-job" hold j1 --json
code 2 "$BIN/hslt-job" list -o "$DIR/list.txt"
code 2 "$BIN/hslt-job" workers j1
code 2 "$BIN/hslt-job" workers --state running

id=$(submit "$BOX" -o "$DIR/cancelled.exr" --integrator path --spp 1000000)
[ "$id" = j1 ] || fail "the first job is $id"
start_worker w1
until_true 10 is_state "$id" running || fail "$id does not run"
code 0 "$BIN/hslt-job" cancel "$id"
grep -qx "$id is cancelled" "$DIR/out" || fail "hslt-job cancel says: $(cat "$DIR/out")"
until_true 5 is_state "$id" cancelled || fail "$id is not cancelled"
code 1 "$BIN/hslt-job" fetch "$id"

"$BIN/hslt-submit" "$BOX" -o "$DIR/waited.exr" --integrator path --spp 1000000 --wait >"$DIR/id" 2>"$DIR/wait.log" &
waiter=$!
PIDS="$PIDS $waiter"
until_true 10 is_state j2 running || fail "j2 does not run"
code 0 "$BIN/hslt-job" cancel j2
got=0
wait $waiter || got=$?
[ $got -eq 3 ] || fail "waiting for a cancelled job ended with $got"
[ "$(cat "$DIR/id")" = j2 ] || fail "stdout is not the id alone"

code 0 "$BIN/hslt-render" "$BOX" -o "$DIR/only.exr" --size 16x16 --target-error 100% # the pilot chooses, too
code 4 "$BIN/hslt-submit" "$BOX" -o "$DIR/bound.exr" --integrator path --spp 16 --target-error 0.01% --wait
code 0 "$BIN/hslt-submit" "$BOX" -o "$DIR/reached.exr" --integrator path --spp 64 --target-error 100% --wait --json
grep -q '"id":"j4".*"state":"done"' "$DIR/out" || fail "--json: $(cat "$DIR/out")"
[ -s "$DIR/reached.exr" ] || fail "no image"

stop $COORDINATOR_PID
[ $CODE -eq 0 ] || fail "the coordinator stopped with $CODE"
LISTEN=$COORDINATOR
start_coordinator
code 0 "$BIN/hslt-job" fetch j4 -o "$DIR/again.exr"
grep -qx "j4: image in $DIR/again.exr" "$DIR/err.log" || fail "hslt-job fetch says: $(cat "$DIR/err.log")"
cmp "$DIR/reached.exr" "$DIR/again.exr" || fail "another result after a restart"
code 0 "$BIN/hslt-job" log j4
untold 1 "$BIN/hslt-job" log j4
untold 1 "$BIN/hslt-job" list
untold 1 "$BIN/hslt-job" list --json
untold 1 "$BIN/hslt-status"
untold 1 "$BIN/hslt-status" --json
untold 1 "$BIN/hslt-status" --watch
grep -q event=job_done "$DIR/out" || fail "the log has no end"
code 0 "$BIN/hslt-job" extend j4 --spp +8
grep -q "^j4 continues after [0-9]* rounds*, until [0-9]* are done" "$DIR/out" || fail "hslt-job extend says: $(cat "$DIR/out")"
id=$(submit "$BOX" -o "$DIR/next.exr" --integrator path --spp 4 -D light=3)
[ "$id" = j5 ] || fail "the next job is $id"
until_true 20 is_state j5 done || fail "the worker did not come back: j5 is $(value j5 state)"

id=$(submit "$BOX" -o "$DIR/long.exr" --integrator path --spp 1000000)
until_true 10 is_state "$id" running || fail "$id does not run"
kill -9 $COORDINATOR_PID
wait $COORDINATOR_PID 2>/dev/null || :
start_coordinator
until_true 20 is_state "$id" running || fail "$id is $(value "$id" state)"
code 0 "$BIN/hslt-job" cancel "$id"
submit "$BOX" -o "$DIR/after.exr" --integrator path --spp 4 --wait >"$DIR/id" || fail "the worker did not come back"
[ "$(cat "$DIR/id")" = j7 ] || fail "the job after the crash is $(cat "$DIR/id")"
untold 1 "$BIN/hslt-submit" "$BOX" -o "$DIR/untold.exr" --integrator path --spp 4
grep -q "the job's id is j8" "$DIR/err.log" || fail "it does not say which job it is: $(cat "$DIR/err.log")"
until_true 20 is_state j8 done || fail "j8 is $(value j8 state)"
# If the image cannot be written, it is still kept by the coordinator.
code 1 "$BIN/hslt-submit" "$BOX" -o /dev/full --integrator path --spp 1 --wait
id=$(cat "$DIR/out")
grep -q "/dev/full: No space left on device. The image stays on the farm: hslt-job fetch $id -o FILE" "$DIR/err.log" ||
	fail "a full disk: $(tail -n 1 "$DIR/err.log")"
code 0 "$BIN/hslt-job" fetch "$id" -o "$DIR/later.exr"
# A job whose output is stdout has no name for its image.
code 0 "$BIN/hslt-submit" "$BOX" -o - --integrator path --spp 1 --wait
id=$(grep -x 'j[0-9]*' "$DIR/err.log")
until_true 20 is_state "$id" done || fail "$id is $(value "$id" state)"
(cd "$DIR/homeless" && code 1 "$BIN/hslt-job" fetch "$id") || exit 1
grep -q 'give one with -o FILE' "$DIR/err.log" && [ -z "$(ls -A "$DIR/homeless")" ] || fail "fetch of a job for stdout: $(cat "$DIR/err.log")"
echo "exit codes and restart"
