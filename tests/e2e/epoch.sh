# SPDX-License-Identifier: Apache-2.0
# The length of an epoch: determined by a pilot for long jobs, longer if the coordinator limits the bandwidth, as given
# by --epoch, and for short jobs the same as in hslt-render. Parts: the farm's bits are those of hslt-render.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-submit hslt-job hslt-worker hslt-render hslt-compare

# epoch FILE: the epoch of the plan that hslt-submit printed; rule FILE WORDS: checks the rule that it names
epoch() {
	sed -n 's/.*epochs of \([0-9]*\) mutations.*/\1/p' "$1"
}

rule() {
	grep -q -e "$2" "$1" || fail "no \"$2\" in: $(cat "$1")"
}

# told NAME OPTION...: submits; JOB is the job's id, and the output goes to NAME
told() {
	name=$DIR/$1
	shift
	JOB=$("$BIN/hslt-submit" "$BOX" -o "$DIR/x.exr" --integrator pssmlt --size 640x360 "$@" 2>"$name") || fail "$(cat "$name")"
	"$BIN/hslt-job" cancel "$JOB" >/dev/null || fail "$JOB is not cancelled"
}

start_coordinator
told long --spp 100000
rule "$DIR/long" "pilot: "
rule "$DIR/long" "leases of about 20 s for a thread"
long=$(epoch "$DIR/long")
told short --spp 16
grep -q pilot "$DIR/short" && fail "a pilot for a short job"
rule "$DIR/short" "for 8 rounds"
told pinned --spp 100000 --epoch 12345
[ "$(epoch "$DIR/pinned")" = 12345 ] || fail "an epoch of $(epoch "$DIR/pinned")"
grep -q "pilot\|epochs:" "$DIR/pinned" && fail "a pilot for an epoch that was asked for"
told parts --spp 16 --parts 64
rule "$DIR/parts" "1024 leases"
"$BIN/hslt-submit" "$BOX" -o "$DIR/x.exr" --integrator pssmlt --parts 3 --chains 1024 --epoch 9 2>"$DIR/odd" && fail "3 parts of 64 chains"
rule "$DIR/odd" "cannot be divided into 3 equal parts"
# A lease of 16 chains with 8,388,608 mutations each is accepted, one with one mutation more per chain is not.
told longest --spp 100000 --epoch 8388608
[ "$(epoch "$DIR/longest")" = 8388608 ] || fail "an epoch of $(epoch "$DIR/longest")"
code 6 "$BIN/hslt-submit" "$BOX" -o "$DIR/x.exr" --integrator pssmlt --spp 100000 --epoch 8388609
grep -q "keeps a thread from all other jobs.*--epoch" "$DIR/err.log" || fail "it says: $(cat "$DIR/err.log")"
code 6 "$BIN/hslt-submit" "$BOX" -o "$DIR/x.exr" --integrator path --spp 100000000 --epoch 1000000
start_worker one
FINE="--integrator pssmlt --size 64x36 --spp 16 --groups 4 --chains 64 --parts 16"
submit "$BOX" -o "$DIR/farm.exr" $FINE --wait >/dev/null || fail "a job of 16 parts"
"$BIN/hslt-render" "$BOX" -o "$DIR/alone.exr" $FINE --quiet 2>>"$DIR/render.log" || fail "hslt-render"
same "$DIR/farm.exr" "$DIR/alone.exr"
grep -aq -e "--parts 16" "$DIR/farm.exr" || fail "the header does not name the parts"
stop "$WORKER" "$COORDINATOR_PID"

start_coordinator --worker-bandwidth 0.01
told slow --spp 100000
rule "$DIR/slow" "2.76 MB of tiles per lease at 0.01 MB/s"
slow=$(epoch "$DIR/slow")
[ "$slow" -gt "$long" ] || fail "epochs of $slow at a slow bandwidth, $long without"
echo "epochs of $long mutations, $slow with 0.01 MB/s a thread"

[ "${FULL:-0}" != 0 ] || exit 0
# Leases take the time that was promised, in seconds of a thread, whatever else the machine does. With FULL=1: a minute.
stop "$COORDINATOR_PID"
start_coordinator -v
start_worker two
id=$("$BIN/hslt-submit" "$HERE/../scenes/demo/scene.xml" -o "$DIR/x.exr" --spp 100000 2>"$DIR/demo") || fail "$(cat "$DIR/demo")"
has_merged() {
	[ "$(grep -c "event=batch_merged job=$id .*kind=2" "$DIR/coordinator.log")" -ge 2 ]
}
until_true 300 has_merged || fail "two leases take longer than five minutes"
"$BIN/hslt-job" hold "$id" 2>>"$DIR/hold.log" || fail "hold"
leases=$(grep -c "event=batch_merged job=$id .*kind=2" "$DIR/coordinator.log")
seconds=$(awk -v a="$(value "$id" cpuSeconds)" -v b="$(value "$id" bootstrapCpuSeconds)" -v n="$leases" 'BEGIN { print (a - b) / n }')
awk -v s="$seconds" 'BEGIN { exit !(s >= 10 && s <= 40) }' || fail "a lease of the demo scene takes $seconds s of a thread"
echo "a lease of the demo scene takes $seconds s of a thread"
