# SPDX-License-Identifier: Apache-2.0
# The predicted cost of errors: estimates of hslt-render and of the farm, against a render that goes there; and the
# status.
. "$(dirname "$0")/lib.sh"
need hslt-render hslt-coordinator hslt-worker hslt-submit hslt-status hslt-job

for p in render submit; do
	code 2 "$BIN/hslt-$p" --estimate "$BOX" -o "$DIR/a.exr"
	code 2 "$BIN/hslt-$p" "$BOX" -o "$DIR/a.exr" --pilot 3
	code 2 "$BIN/hslt-$p" --estimate "$BOX" --pilot 0
	code 2 "$BIN/hslt-$p" --estimate
done
code 1 "$BIN/hslt-render" --estimate "$BOX" --plot "$DIR/no/such/folder.svg"
code 2 "$BIN/hslt-render" --estimate "$BOX" --groups 1 --size 16x16 --integrator path --pilot 0.2
grep -q -- --groups "$DIR/err.log" || fail "one group: $(cat "$DIR/err.log")"

# estimates SECONDS COMMAND...: runs an estimate with a pilot of so many seconds, or of more if the machine is too busy
# and the program says so
estimates() {
	seconds=$1
	shift
	for pilot in $seconds $((10 * seconds)) $((30 * seconds)); do
		got=0
		"$@" --pilot $pilot >"$DIR/out" 2>"$DIR/err.log" || got=$?
		[ $got -eq 1 ] && grep -q 'give it more time' "$DIR/err.log" || break
	done
	[ $got -eq 0 ] || fail "$* ended with $got: $(cat "$DIR/out" "$DIR/err.log")"
}

target() { # FILE TARGET KEY: low, expected, high
	awk -v target="$2" -v key="\"$3\":{" '{
		n = split($0, row, "{\"error\":")
		for (i = 2; i <= n; i++)
			if ((row[i] + 0) / target > 0.999999 && (row[i] + 0) / target < 1.000001) {
				s = substr(row[i], index(row[i], key) + length(key))
				split(s, x, /[:,}]/)
				print x[2], x[4], x[6]
			}
	}' "$1"
}

# The path tracer at several times the pilot's work: its error is as regular as any. A factor 2 beyond the interval
# means a broken model, not bad luck (the interval alone fails 1 time in 10).
how="$BOX --integrator path --size 40x40 --epoch 2 --threads 1 --target-error 3%"
estimates 2 "$BIN/hslt-render" --estimate $how --seed 11 --quiet --json
cp "$DIR/out" "$DIR/estimate.json"
if command -v jq >/dev/null; then
	jq -e '.targets | length == 5' "$DIR/estimate.json" >/dev/null || fail "not five targets"
	jq -e '.pilot.looks | length >= 2' "$DIR/estimate.json" >/dev/null || fail "too few looks"
fi
code 0 "$BIN/hslt-render" $how --seed 12 --quiet -o "$DIR/a.exr" --stats "$DIR/stats.json"
samples=$(sed -n 's/.*"samples": *\([0-9]*\).*/\1/p' "$DIR/stats.json" | head -n 1)
set -- $(target "$DIR/estimate.json" 0.03 mutations)
awk -v n="$samples" -v low="$1" -v high="$3" 'BEGIN { exit !(low > 0 && high < 8 * low && n > low / 2 && n < 2 * high) }' ||
	fail "3 % took $samples samples, predicted were $*"
echo "3 %: $samples samples, predicted $2 ($1 - $3)"
grep -q '"end": *"target-error"' "$DIR/stats.json" || fail "the statistics do not say what ended it"

# The rule by which a target stops is printed first, with its factors.
code 0 "$BIN/hslt-render" $how -o "$DIR/a.exr"
grep -q 'at most 3 %; if the error stays in doubt, once the estimate is at most 1.2 % (1/2.5' "$DIR/err.log" ||
	fail "the rule is not printed: $(cat "$DIR/err.log")"

# Without --epoch the length of a round depends on the target. Rows that the pilot has passed cost no more than they do.
free="$BOX --integrator path --size 40x40 --threads 1"
estimates 2 "$BIN/hslt-render" --estimate $free --seed 11 --quiet --json
cp "$DIR/out" "$DIR/free.json"
for t in 0.1 0.05 0.02; do
	code 0 "$BIN/hslt-render" $free --seed 12 --quiet -o "$DIR/a.exr" --target-error $t --stats "$DIR/free-stats.json"
	n=$(sed -n 's/.*"samples": *\([0-9]*\).*/\1/p' "$DIR/free-stats.json" | head -n 1)
	set -- $(target "$DIR/free.json" $t mutations)
	awk -v n="$n" -v low="$1" -v high="$3" 'BEGIN { exit !(low > 0 && n > low / 2 && n < 2 * high) }' ||
		fail "$t without --epoch took $n samples, predicted were $*"
	echo "$t: $n samples, predicted $2 ($1 - $3)"
done

# A pilot of almost no time continues until its error has been estimated twice: the answer is wide, but no refusal.
code 0 "$BIN/hslt-render" --estimate $how --pilot 0.001 --quiet --json
if command -v jq >/dev/null; then
	jq -e '.targets | length == 5' "$DIR/out" >/dev/null || fail "without time: not five targets: $(cat "$DIR/out")"
fi

estimates 2 "$BIN/hslt-render" --estimate $how --seed 11 --quiet
[ "$(grep -cE '^[0-9.]+ %  +[0-9.]+ (s|min|h|days|years) ' "$DIR/out")" -eq 5 ] || fail "the table: $(cat "$DIR/out")"
if command -v gnuplot >/dev/null; then
	estimates 2 "$BIN/hslt-render" --estimate $how --quiet --plot "$DIR/plot.svg"
	grep -q '</svg>' "$DIR/plot.svg" || fail "the plot is no SVG"
fi

# As in docs/errors.md: neither a bound nor an integrator is given.
demo=$HERE/../scenes/demo/scene.xml
plot=
! command -v gnuplot >/dev/null || plot="--plot $DIR/cost.svg"
estimates 2 "$BIN/hslt-render" --estimate "$demo" --size 320x180 $plot
grep -q '^1 %' "$DIR/out" || fail "the table of the demo: $(cat "$DIR/out")"
grep -q '^integrator .* chosen by a pilot' "$DIR/err.log" || fail "no integrator was chosen: $(cat "$DIR/err.log")"

start_coordinator
start_worker w1
estimates 3 "$BIN/hslt-submit" --estimate "$BOX" --size 40x40
grep -q '^1 %' "$DIR/out" || fail "the table of the farm: $(cat "$DIR/out")"
estimates 3 "$BIN/hslt-submit" --estimate $BOX --integrator path --size 40x40 --epoch 2 --json --target-error 3%
grep -q '"type":"estimate"' "$DIR/out" || fail "the farm's estimate: $(cat "$DIR/out")"
set -- $(target "$DIR/out" 0.03 mutations)
awk -v n="$samples" -v low="$1" -v high="$3" 'BEGIN { exit !(n > low / 2 && n < 2 * high) }' ||
	fail "3 % took $samples samples, the farm predicted $*"

id=$(submit "$BOX" -o "$DIR/b.exr" --integrator path --size 40x40 --epoch 2 --target-error 0.5%)
knows() {
	"$BIN/hslt-status" --json "$id" | grep -q '"nextHalving":{"cpuSeconds":{"low":[0-9]'
}
until_true 20 knows || fail "the status does not say what the next halving costs"
"$BIN/hslt-status" --json "$id" | grep -q '"etaRange":{"low":[0-9]' || fail "nor when it will be done"
"$BIN/hslt-status" "$id" | grep -q 'error .* %), target 0.5 %; halving it takes .* done in' || fail "hslt-status: $("$BIN/hslt-status" "$id")"
code 0 "$BIN/hslt-job" cancel "$id"
code 4 "$BIN/hslt-submit" "$BOX" -o "$DIR/c.exr" --integrator path --size 40x40 --epoch 2 --spp 64 --target-error 0.5% --wait
code 0 "$BIN/hslt-submit" "$BOX" -o "$DIR/d.exr" --integrator path --size 40x40 --epoch 2 --target-error 100% --wait
grep -q 'interval is at most 100 %; if' "$DIR/err.log" || fail "hslt-submit does not print the rule: $(cat "$DIR/err.log")"
"$BIN/hslt-job" list >"$DIR/jobs"
grep -q 'ended by mutations' "$DIR/jobs" && grep -q 'target error reached' "$DIR/jobs" || fail "hslt-job list does not say what ended it"
grep -aq 'hslt:end' "$DIR/c.exr" || fail "the image does not say what ended it"
