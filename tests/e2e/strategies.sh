# SPDX-License-Identifier: Apache-2.0
# Mixtures of strategies: which texts are valid, the options that give the same bits again, and counters that a farm and
# hslt-render share.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-render hslt-compare
INTEGRATOR=${INTEGRATOR:-hslt}
"$BIN/hslt-render" --help | grep -q "integrator=NAME.* $INTEGRATOR" || fail "there is no integrator $INTEGRATOR"
LIST="--mutations hslt=0.75,independent=0.25"
COUNT="--bootstrap 16384 --mutations 40000"

# counters FILE: prints the whole numbers of all strategies, in order, one per line
counters() {
	"${PYTHON:-python3}" - "$1" <<-'END'
		import json, sys

		def show(name, value):
		    if isinstance(value, dict):
		        for inner in value:
		            show(inner, value[inner])
		    elif type(value) is int and name != "stuck":
		        print('"%s":%d' % (name, value))

		for strategy in json.load(open(sys.argv[1]))["strategies"]:
		    show("", strategy)
	END
}

for p in render submit; do
	for list in nothing=1 hslt=0 hslt=0.9,independent=x; do
		code=0
		HSLT_COORDINATOR=127.0.0.1:1 "$BIN/hslt-$p" "$BOX" -o "$DIR/a.exr" --integrator $INTEGRATOR --mutations $list \
			2>"$DIR/wrong.log" || code=$?
		[ $code -eq 2 ] || fail "hslt-$p --mutations $list ended with $code: $(cat "$DIR/wrong.log")"
	done
done

"$BIN/hslt-render" "$BOX" -o "$DIR/a.exr" --integrator $INTEGRATOR $LIST $COUNT --stats "$DIR/a.json" 2>"$DIR/render.log" ||
	fail "hslt-render ended with $?"
grep -q '^strategy .*proposals' "$DIR/render.log" || fail "no table"
grep -q '^hslt  *[0-9]' "$DIR/render.log" || fail "no row for hslt"
proposed=$(counters "$DIR/a.json" | sed -n 's/"proposed"://p' | awk '{ n += $1 } END { print n + 0 }')
samples=$(sed -n 's/.*"samples": *\([0-9]*\).*/\1/p' "$DIR/a.json")
[ "$proposed" -gt 0 ] && [ "$proposed" -le "$samples" ] || fail "$proposed proposals in $samples mutations"
options=$(sed -n 's/ *"options": "\(.*\)",/\1/p' "$DIR/a.json")
"$BIN/hslt-render" "$BOX" -o "$DIR/again.exr" $options --quiet || fail "hslt-render $options ended with $?"
same "$DIR/a.exr" "$DIR/again.exr"
"$BIN/hslt-render" "$BOX" -o "$DIR/plain.exr" --integrator $INTEGRATOR $COUNT --quiet || fail "without a list it ended with $?"

start_coordinator
start_worker w1
start_worker w2
id=$(submit "$BOX" -o "$DIR/farm.exr" --integrator $INTEGRATOR $COUNT $LIST --wait) || fail "hslt-submit ended with $?"
same "$DIR/a.exr" "$DIR/farm.exr"
"$BIN/hslt-status" --json "$id" >"$DIR/status.json"
counters "$DIR/a.json" >"$DIR/by-render"
counters "$DIR/status.json" >"$DIR/by-farm"
[ "$(wc -l <"$DIR/by-farm")" -ge 30 ] || fail "the status has few counters: $(cat "$DIR/by-farm")"
cmp -s "$DIR/by-render" "$DIR/by-farm" || fail "other counters: $(diff "$DIR/by-render" "$DIR/by-farm")"
"$BIN/hslt-status" "$id" | grep -q '^hslt  *[0-9]' || fail "hslt-status shows no table"

# Samples that leave part of their light to chains: each part's share of light, variance and rays; the farm collects
# them from batches.
GLASS="$(dirname "$0")/../scenes/displaced/water.xml --integrator erpt --size 64x36 --spp 32"
"$BIN/hslt-render" $GLASS -o "$DIR/parts.exr" --stats "$DIR/parts.json" 2>"$DIR/parts.log" || fail "erpt ended with $?"
grep -q '^chains that spread .* % of the light, .* % of the variance of the mean, .* % of the rays' "$DIR/parts.log" || fail "no parts"
"${PYTHON:-python3}" - "$DIR/parts.json" <<-'END' || fail "$(grep -A 16 '"parts"' "$DIR/parts.json")"
	import json, sys

	stats = json.load(open(sys.argv[1]))
	samples, chains = stats["parts"]
	assert [samples["part"], chains["part"]] == ["samples", "chains"]
	for share in "energy", "varianceOfB", "rays":
	    assert abs(samples[share] + chains[share] - 1) < 1e-9 and 0 < chains[share] < 1, share
	spread = sum(c["chains"] for c in stats["classes"])
	assert abs(spread / stats["b"] - chains["energy"]) < 1e-9
END
id=$(submit $GLASS -o "$DIR/parts-farm.exr" --wait) || fail "hslt-submit ended with $?"
same "$DIR/parts.exr" "$DIR/parts-farm.exr"
echo "$(sed -n '/^hslt /p' "$DIR/render.log")"
