# SPDX-License-Identifier: Apache-2.0
# The output of `make corpus` for a folder of scenes: how many load, why the others do not, and which crash.
. "$(dirname "$0")/lib.sh"
need hslt-scene

mkdir -p "$DIR/corpus/deep"
echo "<scene version='3.0.0'><sensor type='perspective'/><emitter type='constant'/><shape type='sphere'/></scene>" >"$DIR/corpus/deep/good.xml"
for i in 1 2 3; do
	echo "<scene version='3.0.0'><sensor type='perspective'/><bsdf type='irawan'/><shape type='cube$i'/></scene>" >"$DIR/corpus/cloth$i.xml"
done
echo "<scene version='3.0.0'><sensor type='fluxmeter'/></scene>" >"$DIR/corpus/round.xml"
echo "<scene version='3.0.0'><bsdf type='irawan' id='a'/></scene>" >"$DIR/corpus/part.xml"
echo '{"asset": {"version": "3.0"}}' >"$DIR/corpus/other.gltf"
code 0 sh tests/corpus/corpus.sh "$BIN/hslt-scene" "$DIR/corpus"
grep -q '^ *1 .*glTF of version "N"; N is supported' "$DIR/out" || fail "it reads glTF: $(cat "$DIR/out")"
grep -q "^1 of 6 scenes load" "$DIR/out" || fail "it counts: $(cat "$DIR/out")"
grep -q '^ *3 <bsdf type="irawan">: this bsdf of Mitsuba' "$DIR/out" || fail "it groups: $(cat "$DIR/out")"
code 0 sh tests/corpus/corpus.sh "$BIN/hslt-scene" "$DIR/corpus" --lenient
grep -q "^4 of 6 scenes load" "$DIR/out" || fail "with --lenient it counts: $(cat "$DIR/out")"
code 2 sh tests/corpus/corpus.sh "$BIN/hslt-scene" "$DIR/none"
printf '#!/bin/sh\nexit 134\n' >"$DIR/crash" && chmod +x "$DIR/crash"
code 1 sh tests/corpus/corpus.sh "$DIR/crash" "$DIR/corpus"
grep -q "cloth1.xml: exit code 134" "$DIR/out" || fail "of a crash it says: $(cat "$DIR/out")"
