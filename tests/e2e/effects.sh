# SPDX-License-Identifier: Apache-2.0
# Effects that a scene calls for are listed, can be overridden, and give the same bits on the farm and in hslt-render;
# files that the scene does not need are not sent.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-render hslt-compare
HERE=$(cd "$(dirname "$0")/.." && pwd)

# The box, with a textured material that no shape uses.
cp -r "$HERE/scenes/box/." "$DIR/scene"
head -c 4000 /dev/urandom >"$DIR/scene/unused.png"
sed "s|</scene>|<bsdf type='diffuse' id='nobody'><texture name='reflectance' type='bitmap'><string name='filename' value='unused.png'/></texture></bsdf></scene>|" \
	"$HERE/scenes/box/box.xml" >"$DIR/scene/box.xml"
SCENE=$DIR/scene/box.xml

"$BIN/hslt-render" --explain "$SCENE" >"$DIR/list" 2>"$DIR/log" || fail "--explain ended with $?: $(cat "$DIR/log")"
grep -q '^textures  *off' "$DIR/list" || fail "textures of a material that nobody uses: $(cat "$DIR/list")"
grep -q '^aperture  *off' "$DIR/list" || fail "no word on the aperture"
# A scene that sets no number of samples, rendered without a bound.
"$BIN/hslt-render" --explain "${BOX%/*}/../smoke/scene.xml" | grep -q '^scattering *on ' || fail "--explain needs a bound"
"$BIN/hslt-render" --explain --effects=+aperture "$SCENE" 2>/dev/null | grep -q '^aperture  *on (forced)' || fail "not forced"

# Which integrators were considered, which was chosen, and why: in --explain and --stats.
"$BIN/hslt-render" --explain --json "$SCENE" --spp 32 >"$DIR/explained.json" 2>"$DIR/log" || fail "--explain --json: $(cat "$DIR/log")"
"$BIN/hslt-render" "$SCENE" -o "$DIR/b.exr" --stats "$DIR/stats.json" --spp 32 --size 64x36 --quiet || fail "hslt-render --stats"
python3 - "$DIR/explained.json" "$DIR/stats.json" <<-'END' || fail "$(cat "$DIR/explained.json")"
	import json, sys
	for name in sys.argv[1:]:
	    o = json.load(open(name))
	    c = o["choice"]
	    assert o["integrator"] == "path" and c["considered"] == ["path", "bdpt8", "erpt4", "erpt", "hslt"] and c["why"].startswith("path, by a pilot:"), c
	    assert c["pilotSamples"] >= 8192 and not c["pathMissesLight"] and not c["surfacesFocusLight"], c
	    assert 0 < c["path"]["largestShare"] < 0.03, c
	    assert c["path"]["tailIndex"] > 2.1 and 0 < c["path"]["varianceTimesRays"] < 0.75 * c["bdpt"]["varianceTimesRays"], c
END
"$BIN/hslt-render" --explain "$SCENE" --spp 32 | grep -q '^path, by a pilot' || fail "--explain does not say why"
"$BIN/hslt-render" --explain "$SCENE" -i bdpt | grep -q '^as requested; otherwise a pilot' || fail "--explain -i bdpt"
"$BIN/hslt-render" --explain --json "$SCENE" -i bdpt | grep -q '"choice":null' || fail "--explain --json -i bdpt"

for p in render submit; do
	code=0
	HSLT_COORDINATOR=127.0.0.1:1 "$BIN/hslt-$p" "$SCENE" -o "$DIR/a.exr" --effects=+apertur 2>"$DIR/wrong.log" || code=$?
	[ $code -eq 2 ] && grep -q aperture "$DIR/wrong.log" || fail "hslt-$p --effects=+apertur: $code, $(cat "$DIR/wrong.log")"
done

OPTIONS="--size 64x36 --spp 32 --effects=+aperture"
"$BIN/hslt-render" "$SCENE" -o "$DIR/a.exr" $OPTIONS --quiet || fail "hslt-render ended with $?"
start_coordinator
start_worker w1
id=$(submit "$SCENE" -o "$DIR/farm.exr" $OPTIONS --wait) || fail "hslt-submit ended with $?"
same "$DIR/a.exr" "$DIR/farm.exr"
"$BIN/hslt-status" "$id" >"$DIR/said"
grep -q 'on *(forced) *aperture' "$DIR/said" || fail "an ended job does not list its effects: $(cat "$DIR/said")"
[ -z "$(find "$DIR" -path '*blobs*' -type f -size 4000c)" ] || fail "a texture of a material that nobody uses was sent"
