# SPDX-License-Identifier: Apache-2.0
# hslt-scene: reports all errors of a file in one run, describes a good file, and with --lenient replaces unsupported
# parts.
. "$(dirname "$0")/lib.sh"
PROGRAMS=$(cd "$BIN" && pwd)
need hslt-scene hslt-render hslt-compare hslt-submit hslt-accuracy

code 0 "$BIN/hslt-scene" --help
grep -qi example "$DIR/out" || fail "--help has no examples"
code 2 "$BIN/hslt-scene" look "$BOX"
code 2 "$BIN/hslt-scene" check
code 1 "$BIN/hslt-scene" check "$DIR/none.xml"

cat >"$DIR/bad.xml" <<'XML'
<scene version="3.0.0">
<integrator type="volpath"><integer name="rr_depth" value="5"/></integrator>
<sensor type="perspectiv"/>
<bsdf type="irawan" id="fur"/>
<shape type="sphere">
	<ref id="fur"/>
	<float name="radios" value="1"/>
	<medium type="smoke" name="interior"/>
</shape>
<shape type="cube"><ref id="fur"/><bsdf type="diffuse"><rgb name="reflectance" value="2 0 0"/></bsdf></shape>
<shape type="cube"><transform name="to_world"><rotate angle="10"/></transform></shape>
</scene>
XML
code 1 "$BIN/hslt-scene" check "$DIR/bad.xml"
cut -d: -f1,2 "$DIR/out" | tr '\n' ' ' >"$DIR/places"
for line in 3 4 7 8 10 11; do
	grep -q "bad.xml:$line " "$DIR/places" || fail "nothing is said of line $line: $(cat "$DIR/out")"
done
[ "$(grep -c 'type="irawan"' "$DIR/out")" = 1 ] || fail "one unknown material is complained of more than once: $(cat "$DIR/out")"
grep -q "^$DIR/bad.xml: 6 problems" "$DIR/out" || fail "it does not sum up: $(tail -n 1 "$DIR/out")"
code 1 "$BIN/hslt-render" "$DIR/bad.xml" -o "$DIR/bad.exr"
grep -q "bad.xml:3.*and at least 5 more: hslt-scene check lists all" "$DIR/err.log" || fail "a render says: $(cat "$DIR/err.log")"

# Errors that only building finds are listed in the same run, in the order of lines, but not those that merely follow
# from errors of the reader.
cat >"$DIR/deep.xml" <<'XML'
<scene version="3.0.0"><sensor type="perspective"/><emitter type="constant"/>
<shape type="instance"/>
<shape type="instance"><ref id="nothing"/></shape>
<shape type="instance"><shape type="sphere"/></shape>
<shape type="ply"/>
<shape type="ply">
	<string name="filenam" value="x.ply"/>
</shape>
<shape type="ply">
	<bsdf type="irawan"/>
</shape>
<shape type="sphere">
	<bsdf type="mask">
		<bsdf type="irawan"/>
	</bsdf>
</shape>
<shape type="sphere"><bsdf type="mask"/></shape>
<emitter type="envmap"/>
<emitter type="area"/>
</scene>
XML
code 1 "$BIN/hslt-scene" check "$DIR/deep.xml"
[ "$(sed -n 's|.*/deep.xml:\([0-9]*\): .*|\1|p' "$DIR/out" | tr '\n' ' ')" = "2 3 4 5 7 9 10 14 17 18 19 " ] || fail "not one line each: $(cat "$DIR/out")"
grep -q "^$DIR/deep.xml: 11 problems" "$DIR/out" || fail "it does not sum up: $(tail -n 1 "$DIR/out")"

sed 's|<integer name="rr_depth" value="5"/>|<boolean name="hide_emitters" value="ture"/>|' "$DIR/bad.xml" >"$DIR/ture.xml"
code 1 "$BIN/hslt-scene" check "$DIR/ture.xml"
grep -q '`ture` is neither true nor false; did you mean `true`?' "$DIR/out" || fail "of ture it says: $(cat "$DIR/out")"

# Instances are counted as in the file, even where copies of their meshes are faster; an instance of two shapes counts
# once.
cat >"$DIR/small.xml" <<'XML'
<scene version="3.0.0"><sensor type="perspective"/><emitter type="constant"/>
<shape type="shapegroup" id="g"><shape type="cube"/><shape type="rectangle"/></shape>
<shape type="instance"><ref id="g"/></shape>
<shape type="instance"><ref id="g"/><transform name="to_world"><translate x="3"/></transform></shape>
<shape type="instance"><ref id="g"/><transform name="to_world"><translate x="6"/></transform></shape>
</scene>
XML
code 0 "$BIN/hslt-scene" show --json "$DIR/small.xml"
grep -q '"shapes":6,.*"instances":3,"sharingShapes":0,"sharedMeshes":0,' "$DIR/out" || fail "three instances: $(cat "$DIR/out")"
code 0 "$BIN/hslt-scene" show "$DIR/small.xml"
grep -q '^6 shapes (3 instances), 42 triangles, ' "$DIR/out" || fail "three instances: $(cat "$DIR/out")"
awk 'BEGIN { for (i = 0; i < 9; i++) print "v", i % 3, int(i / 3), i % 2; for (i = 0; i < 40; i++) { a = i % 2 + 3 * int(i / 2 % 2) + 1; print "f", a, a + 1, a + 3 } }' >"$DIR/many.obj"
sed 's|<shape type="cube"/>|<shape type="obj"><string name="filename" value="many.obj"/></shape>|' "$DIR/small.xml" >"$DIR/large.xml"
code 0 "$BIN/hslt-scene" show "$DIR/large.xml"
grep -q '^6 shapes (3 instances; 3 share 1 mesh), 126 triangles (46 in memory), ' "$DIR/out" || fail "instances that share: $(cat "$DIR/out")"

# Errors are in the order of lines, missing files among them.
cat >"$DIR/order.xml" <<'XML'
<scene version="3.0.0"><integrator type="path"/>
<shape type="obj"><string name="filename" value="none.obj"/></shape>
<shape type="sphere"><float name="radios" value="1"/></shape>
<shape type="obj"><string name="filename" value="none-either.obj"/></shape>
<shape type="sphere"><float name="radios" value="1"/></shape>
</scene>
XML
code 1 "$BIN/hslt-scene" check "$DIR/order.xml"
[ "$(sed -n 's/^\/.*\/order.xml:\([0-9]*\): .*/\1/p' "$DIR/out" | tr '\n' ' ')" = "2 3 4 5 " ] || fail "not in the order of lines: $(cat "$DIR/out")"
code 1 "$BIN/hslt-render" "$DIR/order.xml" -o "$DIR/bad.exr"
grep -q "order.xml:3.*and at least 3 more: hslt-scene check lists all" "$DIR/err.log" || fail "of files that are not there a render says: $(cat "$DIR/err.log")"
sed '/radios/d' "$DIR/order.xml" >"$DIR/missing.xml"
for program in "hslt-render" "hslt-submit --coordinator 127.0.0.1:9"; do
	"$BIN"/$program "$DIR/missing.xml" -o "$DIR/bad.exr" --spp 1 >"$DIR/out" 2>"$DIR/err.log" && fail "$program: without the meshes"
	grep -q "missing.xml:2.*none.obj.*and at least 1 more: hslt-scene check lists all" "$DIR/err.log" || fail "$program says: $(cat "$DIR/err.log")"
done

# A message begins with a file name that can be opened from here; notes in images do not.
mkdir "$DIR/parts"
echo '<scene version="3.0.0"><shape type="spher"/></scene>' >"$DIR/parts/odd.xml"
echo '<scene version="3.0.0"><sensor type="perspective"/><emitter type="constant"/><include filename="parts/odd.xml"/></scene>' >"$DIR/whole.xml"
for from in "$DIR:whole.xml:" "$DIR/parts:../whole.xml:../" "/:$DIR/whole.xml:$DIR/"; do
	place=${from#*:}
	(cd "${from%%:*}" && "$PROGRAMS/hslt-scene" check "${place%%:*}") >"$DIR/out" && fail "$from: a shape that is none"
	grep -q "^${place#*:}parts/odd.xml:1: <shape" "$DIR/out" || fail "$from: $(cat "$DIR/out")"
	(cd "${from%%:*}" && "$PROGRAMS/hslt-render" -i path --size 8 --spp 2 --lenient "${place%%:*}" -o "$DIR/whole.exr") 2>"$DIR/err.log" ||
		fail "$from: $(cat "$DIR/err.log")"
	grep -q "^note: ${place#*:}parts/odd.xml:1: " "$DIR/err.log" || fail "$from: $(cat "$DIR/err.log")"
	grep -aq "parts/odd.xml:1: " "$DIR/whole.exr" && ! grep -aq "[./]parts/odd.xml" "$DIR/whole.exr" || fail "$from: the image has the place here"
done
# So does a message about the scene file as a whole.
(cd / && "$PROGRAMS/hslt-scene" check "$DIR/parts") >"$DIR/out" 2>&1 && fail "a folder is no scene"
grep -q "$DIR/parts: not a regular file" "$DIR/out" || fail "of a folder it says: $(cat "$DIR/out")"

# A film of more pixels than one render may have.
cat >"$DIR/wall.xml" <<'XML'
<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm"><integer name="width" value="4097"/><integer name="height" value="4096"/>
</film></sensor><emitter type="constant"/><shape type="sphere"/></scene>
XML
code 0 "$BIN/hslt-scene" check "$DIR/wall.xml"
grep -q '^note: the image has 16781312 pixels; a render has at most 16777216' "$DIR/out" || fail "of a large film it says: $(cat "$DIR/out")"
sed 's/4097/4096/' "$DIR/wall.xml" >"$DIR/less.xml"
code 0 "$BIN/hslt-scene" check "$DIR/less.xml"
! grep -q 'a render has at most' "$DIR/out" || fail "of a film that is just small enough it says: $(cat "$DIR/out")"

# Errors that the reader alone cannot see.
sed 's/filename" value="[^"]*"/filename" value="gone.obj"/' "$BOX" >"$DIR/gone.xml"
if grep -q gone.obj "$DIR/gone.xml"; then
	code 1 "$BIN/hslt-scene" check "$DIR/gone.xml"
	grep -qi "gone.xml:[0-9]*: .*gone.obj: no such file" "$DIR/out" || fail "a missing mesh: $(cat "$DIR/out")"
fi
cat >"$DIR/gone2.xml" <<'XML'
<scene version="3.0.0"><sensor type="perspective"/><emitter type="envmap"><string name="filename" value="sky.hdr"/></emitter>
<shape type="obj"><string name="filename" value="a.obj"/></shape>
<shape type="ply"><string name="filename" value="b.ply"/></shape><shape type="ply"><string name="filename" value="b.ply"/></shape>
</scene>
XML
code 1 "$BIN/hslt-scene" check "$DIR/gone2.xml"
grep -q "^$DIR/gone2.xml: 3 problems" "$DIR/out" && grep -q 'gone2.xml:2: <shape type="obj">: a.obj: no such file' "$DIR/out" ||
	fail "not all missing files are said: $(cat "$DIR/out")"

# A missing file to include, and a name without a value, do not hide other errors.
cat >"$DIR/hole.xml" <<'XML'
<scene version="3.0.0"><sensor type="perspective"/><emitter type="constant"/>
<include filename="hole.part.xml"/>
<shape type="sphere"><float name="radius" value="$r"/><ref id="of-the-part"/></shape>
<shape type="obj"><string name="filename" value="a.obj"/></shape>
<shape type="spher"/></scene>
XML
code 1 "$BIN/hslt-scene" check "$DIR/hole.xml"
[ "$(sed -n 's/^\/.*\/hole.xml:\([0-9]*\): .*/\1/p' "$DIR/out" | tr '\n' ' ')" = "2 4 5 " ] && grep -q "^$DIR/hole.xml: 3 problems" "$DIR/out" ||
	fail "a hole hides or makes problems: $(cat "$DIR/out")"
code 1 "$BIN/hslt-scene" check -D r=1 "$DIR/hole.xml"
grep -q "^$DIR/hole.xml: 3 problems" "$DIR/out" || fail "a hole with a value: $(cat "$DIR/out")"

# A missing scene: it is not one of the scene's files, which --path could find.
for program in "$BIN/hslt-scene check" "$BIN/hslt-render -o $DIR/a.exr" "$BIN/hslt-render --explain" "$BIN/hslt-submit -c 127.0.0.1:1 -o $DIR/a.exr" \
	"$BIN/hslt-accuracy -o $DIR/a.html"; do
	code 1 $program "$DIR/hle.xml"
	grep -qF ": $DIR/hle.xml: no such file; did you mean \`hole.xml\`?" "$DIR/err.log" || fail "$program: $(cat "$DIR/err.log")"
	code 1 $program "$DIR/nowhere/scene.xml"
	grep -q "/nowhere/scene.xml: no such file$" "$DIR/err.log" || fail "$program: $(cat "$DIR/err.log")"
done
ln -s nothing.xml "$DIR/dangling.xml"
code 1 "$BIN/hslt-render" -o "$DIR/a.exr" "$DIR/dangling.xml"
grep -q "/dangling.xml: a link to a file that is not there$" "$DIR/err.log" || fail "a dangling link: $(cat "$DIR/err.log")"
rm "$DIR/dangling.xml"

# File names from Windows differ in capitals.
: >"$DIR/stone.png"
cat >"$DIR/capitals.xml" <<'XML'
<scene version="3.0.0"><sensor type="perspective"/><emitter type="constant"/><shape type="sphere"><bsdf type="diffuse">
<texture type="bitmap" name="reflectance"><string name="filename" value="Stone.PNG"/></texture></bsdf></shape></scene>
XML
code 1 "$BIN/hslt-scene" check "$DIR/capitals.xml"
grep -q '/capitals.xml:2: .*Stone.PNG: no such file in the scene.s folder; did you mean `stone.png`? --lenient leaves the texture out$' \
	"$DIR/out" || fail "a name with other capitals: $(cat "$DIR/out")"

# Textures that are missing, or not in a folder that may be read, are left out by --lenient.
cat >"$DIR/lost.xml" <<'XML'
<scene version="3.0.0"><sensor type="perspective"/><emitter type="constant"/><shape type="sphere"><bsdf type="mask">
<texture type="bitmap" name="opacity"><string name="filename" value="lost.png"/></texture>
<bsdf type="diffuse"><texture type="bitmap" name="reflectance"><string name="filename" value="/etc/lost.png"/></texture></bsdf>
</bsdf></shape></scene>
XML
code 1 "$BIN/hslt-scene" check "$DIR/lost.xml"
grep -q "^$DIR/lost.xml: 2 problems" "$DIR/out" && grep -q "lost.png: .*; --lenient leaves the texture out" "$DIR/out" || fail "of lost textures it says: $(cat "$DIR/out")"
code 1 "$BIN/hslt-render" --size 16 --spp 1 "$DIR/lost.xml" -o "$DIR/lost.exr"
grep -q "lost.xml:[23]: .*lost.png: " "$DIR/err.log" || fail "a render with a lost texture: $(cat "$DIR/err.log")"
code 0 "$BIN/hslt-scene" check --lenient "$DIR/lost.xml"
grep -q "lost.xml:2: .*lost.png is not among the scene's files; left out" "$DIR/out" &&
	grep -q "lost.xml:3: .*/etc/lost.png is not among the scene's files; left out" "$DIR/out" ||
	fail "of lost textures --lenient says: $(cat "$DIR/out")"
code 0 "$BIN/hslt-render" --lenient --size 16 --spp 1 "$DIR/lost.xml" -o "$DIR/lost.exr"

# Files in another folder are found through --path, with the same picture.
mkdir "$DIR/apart" "$DIR/library"
sed 's:<sensor:<path value="../library"/><sensor:' "$BOX" >"$DIR/apart/box.xml"
cp -r "${BOX%/*}/meshes" "$DIR/library"
code 1 "$BIN/hslt-scene" check "$DIR/apart/box.xml"
grep -q '\.\./library/meshes/wedge.obj: leads out' "$DIR/out" || fail "of a mesh elsewhere it says: $(cat "$DIR/out")"
allowed=$(sed -n 's/.*to allow that, give --path //p' "$DIR/out" | head -n 1)
code 0 "$BIN/hslt-scene" check --path "$allowed" "$DIR/apart/box.xml"
code 0 "$BIN/hslt-scene" check --path "$DIR/library" "$DIR/apart/box.xml"
code 0 "$BIN/hslt-render" --size 16 --spp 1 -i path --path "$DIR/library" "$DIR/apart/box.xml" -o "$DIR/apart.exr"
code 0 "$BIN/hslt-render" --size 16 --spp 1 -i path "$BOX" -o "$DIR/whole.exr"
code 0 "$BIN/hslt-compare" "$DIR/apart.exr" "$DIR/whole.exr"
grep -q "^relMSE  *0 " "$DIR/out" || fail "the image is another with --path: $(cat "$DIR/out")"
code 2 "$BIN/hslt-render" --path "$DIR/nowhere" "$BOX" -o "$DIR/x.exr"
grep -q "is not a folder" "$DIR/err.log" || fail "a --path that is not there: $(cat "$DIR/err.log")"

# Sensors are chosen by their ids.
mkdir "$DIR/two"
cp -r "${BOX%/*}/meshes" "$DIR/two"
sed 's:</scene>:<sensor type="perspective" id="aside"><float name="fov" value="30"/></sensor></scene>:' "$BOX" >"$DIR/two/two.xml"
code 0 "$BIN/hslt-scene" check "$DIR/two/two.xml"
grep -q 'sensor 2 ("aside"); without --sensor' "$DIR/out" || fail "of two sensors it says: $(cat "$DIR/out")"
for sensor in 2 aside; do
	code 0 "$BIN/hslt-render" --size 16x12 --spp 1 -i path --sensor $sensor "$DIR/two/two.xml" -o "$DIR/two-$sensor.exr"
done
code 0 "$BIN/hslt-compare" --exact "$DIR/two-2.exr" "$DIR/two-aside.exr"
code 1 "$BIN/hslt-render" --size 16x12 --spp 1 -i path --sensor asied "$DIR/two/two.xml" -o "$DIR/none.exr"
grep -q "no sensor with the id 'asied'; did you mean .aside.?" "$DIR/err.log" || fail "another id: $(cat "$DIR/err.log")"
code 1 "$BIN/hslt-submit" --coordinator 127.0.0.1:1 --sensor overhead "$DIR/two/two.xml" -o "$DIR/none.exr"
grep -q "no sensor with the id 'overhead' (it has 2, numbered from 1; ids: aside)" "$DIR/err.log" || fail "another id: $(cat "$DIR/err.log")"

# A batch sensor is split into its sensors, each with its share of the film.
camera() { # camera NAME X
	echo "<sensor type='perspective' id='$1'><transform name='to_world'><lookat origin='$2,0,5' target='0,0,0' up='0,1,0'/></transform>${3-}</sensor>"
}
film() {
	echo "<film type='hdrfilm'><integer name='width' value='$1'/><integer name='height' value='12'/><rfilter type='box'/></film>"
}
rest='<shape type="cube"/><emitter type="point"><point name="position" value="1,2,4"/></emitter></scene>'
echo "<scene version='3.0.0'><sensor type='batch'>$(camera left -3 "$(film 100)")$(camera right 3)$(film 32)</sensor>$rest" >"$DIR/batch.xml"
echo "<scene version='3.0.0'>$(camera left -3 "$(film 16)")$(camera right 3 "$(film 16)")$rest" >"$DIR/apart.xml"
code 0 "$BIN/hslt-scene" check "$DIR/batch.xml"
grep -q 'sensor 2 ("right"); without --sensor' "$DIR/out" || fail "of a batch it says: $(cat "$DIR/out")"
for sensor in 1 right; do
	for file in batch apart; do
		code 0 "$BIN/hslt-render" --spp 1 -i path --sensor $sensor "$DIR/$file.xml" -o "$DIR/$file-$sensor.exr"
	done
	code 0 "$BIN/hslt-compare" "$DIR/batch-$sensor.exr" "$DIR/apart-$sensor.exr"
	grep -q "^relMSE  *0 " "$DIR/out" || fail "a batch's sensor $sensor renders another image: $(cat "$DIR/out")"
done
for bad in "$(camera a 1)$(camera b 2)$(camera c 3)$(film 32)" "$(film 32)" "<sensor type='batch'>$(camera a 1)$(film 2)</sensor>$(film 32)"; do
	echo "<scene version='3.0.0'><sensor type='batch'>$bad</sensor>$rest" >"$DIR/bad.xml"
	code 1 "$BIN/hslt-scene" check "$DIR/bad.xml"
	grep -q 'bad.xml:1: .*batch' "$DIR/out" || fail "of a bad batch it says: $(cat "$DIR/out")"
done

code 0 "$BIN/hslt-scene" check "$BOX"
grep -q "^$BOX: can be rendered: [0-9]* shapes" "$DIR/out" || fail "of a good scene it says: $(cat "$DIR/out")"
code 0 "$BIN/hslt-scene" show "$BOX"
sum=$(sha256sum "$BOX" | cut -c1-16)
grep -q "^$sum .* box.xml$" "$DIR/out" || fail "show has no file box.xml with its hash: $(cat "$DIR/out")"
code 0 "$BIN/hslt-scene" show --json "$BOX"
grep -q "\"schema\":1.*\"sha256\":\"$(sha256sum "$BOX" | cut -d' ' -f1)\"" "$DIR/out" || fail "--json says: $(cat "$DIR/out")"
# Unsupported parts, and the scene that is rendered instead.
scene() { # scene FILE FILTER LIGHT BSDF INSIDE MORE
	cat >"$DIR/$1" <<XML
<scene version="3.0.0">
<sensor type="perspective"><float name="fov" value="40"/>
	<transform name="to_world"><lookat origin="0,-6,3" target="0,0,1" up="0,0,1"/></transform>
	<film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="16"/><rfilter type="$2"/></film></sensor>
<emitter type="constant"><rgb name="radiance" value="1 1 1"/></emitter>$3
$4
<shape type="sphere"><point name="center" x="0" y="0" z="1"/><ref id="stuff"/>$5</shape>$6
<shape type="rectangle"><transform name="to_world"><scale value="10"/></transform>
	<bsdf type="diffuse"><rgb name="reflectance" value="0.2 0.5 0.2"/></bsdf></shape>
</scene>
XML
}
scene strange.xml wiener '<emitter type="aurora"><float name="power" value="3"/></emitter>' \
	'<bsdf type="bark" id="stuff"><texture type="perlin" name="knots"/><bsdf type="irawan"><rgb name="base_color" value="0.8 0.2 0.1"/><float name="melanin" value="0.3"/></bsdf></bsdf>' \
	'<medium name="interior" type="heterogeneous"><volume type="volcache" name="sigma_t"/><float name="albedo" value="0.5"/></medium>' \
	'<shape type="ellipsoids"><string name="filename" value="h.hair"/></shape><volume type="grid"/>'
scene plain.xml gaussian '' '<bsdf type="diffuse" id="stuff"><rgb name="reflectance" value="0.8 0.2 0.1"/></bsdf>' '' ''
code 1 "$BIN/hslt-scene" check "$DIR/strange.xml"
code 0 "$BIN/hslt-scene" check --lenient "$DIR/strange.xml"
for word in wiener aurora bark melanin '`volcache`' 'type="heterogeneous"' '`ellipsoids`' '<bsdf type="irawan">' volume; do
	grep "^note: .*(lenient)" "$DIR/out" | grep -q "$word" || fail "nothing is noted of $word: $(cat "$DIR/out")"
done
code 1 "$BIN/hslt-render" -i path --spp 4 "$DIR/strange.xml" -o "$DIR/strange.exr"
code 0 "$BIN/hslt-render" -i path --spp 4 --lenient "$DIR/strange.xml" -o "$DIR/strange.exr"
grep -q "strange.xml:[0-9]*: .*melanin.*(lenient)" "$DIR/err.log" || fail "a lenient render does not note it: $(cat "$DIR/err.log")"
grep -aq "lenient=yes" "$DIR/strange.exr" || fail "the image does not say that it was read leniently"
code 0 "$BIN/hslt-render" -i path --spp 4 "$DIR/plain.xml" -o "$DIR/plain.exr"
code 0 "$BIN/hslt-compare" "$DIR/strange.exr" "$DIR/plain.exr"
grep -q "^relMSE  *0 " "$DIR/out" || fail "the lenient image is not that of the scene it stands for: $(cat "$DIR/out")"
# A material that can cover only opaque ones, over one that transmits light.
hole='<bsdf type="mask"><float name="opacity" value="0.5"/><bsdf type="diffuse"/></bsdf>'
scene covered.xml box '' "<bsdf type='coating' id='stuff'><bsdf type='twosided'>$hole</bsdf></bsdf>" '' ''
echo "$hole" | sed 's/type="mask"/type="mask" id="stuff"/' >"$DIR/hole"
scene plain.xml box '' "$(cat "$DIR/hole")" '' ''
code 1 "$BIN/hslt-scene" check "$DIR/covered.xml"
code 0 "$BIN/hslt-scene" check --lenient "$DIR/covered.xml"
grep -q '<bsdf type="coating"> over "mask".*(lenient)' "$DIR/out" || fail "nothing is noted of the coating: $(cat "$DIR/out")"
for file in covered plain; do
	code 0 "$BIN/hslt-render" -i path --spp 2 --lenient "$DIR/$file.xml" -o "$DIR/$file.exr"
done
code 0 "$BIN/hslt-compare" "$DIR/covered.exr" "$DIR/plain.exr"
grep -q "^relMSE  *0 " "$DIR/out" || fail "an uncovered mask is another: $(cat "$DIR/out")"
# Errors that only building a scene shows: all of these are listed, too.
scene deep.xml box '' '<bsdf type="conductor" id="stuff"><string name="material" value="Xy"/></bsdf>' '' \
	'<shape type="sphere"><bsdf type="coating"><bsdf type="dielectric"/></bsdf></shape>'
code 1 "$BIN/hslt-scene" check "$DIR/deep.xml"
for word in 'unknown conductor "Xy"' 'a coating over "dielectric"' '2 problems'; do
	grep -q "$word" "$DIR/out" || fail "$word: $(cat "$DIR/out")"
done
# Leniency does not apply to wrong values of supported parts, nor to parts without a replacement.
sed 's/value="24"/value="wide"/' "$DIR/strange.xml" >"$DIR/wrong.xml"
code 1 "$BIN/hslt-scene" check --lenient "$DIR/wrong.xml"
sed 's/"perspective"/"fisheye"/' "$DIR/strange.xml" >"$DIR/wrong.xml"
code 1 "$BIN/hslt-scene" check --lenient "$DIR/wrong.xml"
grep -q fisheye "$DIR/out" || fail "of a sensor without a stand-in it says: $(cat "$DIR/out")"
# A scene of emitters alone, which are hidden: no options of the author are blamed.
echo "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' value='1'/><boolean name='hide_emitters' value='true'/></integrator>$(
	camera one 0)$rest" >"$DIR/hidden.xml"
code 2 "$BIN/hslt-render" "$DIR/hidden.xml" -o "$DIR/hidden.exr" --size 16 --spp 16
grep -q 'nothing is left to render.*hide_emitters.*--max-depth 2' "$DIR/err.log" || fail "of nothing to render it says: $(cat "$DIR/err.log")"
code 0 "$BIN/hslt-render" "$DIR/hidden.xml" -o "$DIR/hidden.exr" --size 16 --spp 16 --max-depth 2
echo "check and show: all problems with their places, and what a good scene holds"
