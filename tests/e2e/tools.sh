# SPDX-License-Identifier: Apache-2.0
# hslt-compare and hslt-tonemap as programs: exit codes, output, files.
. "$(dirname "$0")/lib.sh"
need hslt-render hslt-compare hslt-tonemap hslt-assemble hslt-accuracy hslt-submit

render() { # FILE SEED SIZE
	code 0 "$BIN/hslt-render" "$BOX" -o "$DIR/$1.exr" --integrator path --spp 4 --seed "$2" --size "$3" --threads 1 --quiet --stats /dev/null
}

for p in compare tonemap; do
	code 0 "$BIN/hslt-$p" --version
	code 0 "$BIN/hslt-$p" --help
	grep -qi example "$DIR/out" || fail "hslt-$p --help has no examples"
	code 2 "$BIN/hslt-$p" --no-such-option
	code 2 "$BIN/hslt-$p" "$DIR/a.exr"
	code 1 "$BIN/hslt-$p" "$DIR/none.exr" "$DIR/none.png"
	grep -q "none.exr" "$DIR/err.log" || fail "hslt-$p does not name the file"
done

render a 1 32x32
render again 1 32x32
render other 2 32x32
render large 1 64x64
mkdir "$DIR/folder" && cp "$DIR/other.exr" "$DIR/folder/real.exr" && ln -s folder/real.exr "$DIR/link.exr"
render link 1 32x32
"$BIN/hslt-render" "$BOX" -o - --integrator path --spp 4 --seed 1 --size 32x32 --threads 1 >"$DIR/stdout.exr" 2>"$DIR/err.log" || fail "-o -: $(cat "$DIR/err.log")"
cp "$BOX" "$DIR/scene.xml"
cp "$BOX" "$DIR/box.xml"
cp -r "${BOX%/*}/meshes" "$DIR"
cd "$DIR"
code 0 "$BIN/hslt-compare" --exact a.exr again.exr
code 0 "$BIN/hslt-compare" --exact a.exr stdout.exr
code 1 "$BIN/hslt-compare" --exact a.exr other.exr
grep -q "^different: channel" out || fail "--exact says: $(cat out)"
code 1 "$BIN/hslt-compare" --exact --json a.exr other.exr
grep -q '"equal":false' out || fail "--exact --json says: $(cat out)"
code 2 "$BIN/hslt-compare" --exact --trim 0.1 a.exr other.exr
code 2 "$BIN/hslt-compare" --trim 1 a.exr other.exr
code 2 "$BIN/hslt-compare" --max-relmse x a.exr other.exr
code 0 "$BIN/hslt-compare" a.exr other.exr --max-relmse 1e6
grep -q '^relMSE  *[0-9.e+-]* (mean over pixels and channels of (A-B)^2 / (B^2 + (0.01 m)^2)' out || fail "no relMSE: $(cat out)"
code 1 "$BIN/hslt-compare" a.exr other.exr --max-relmse 1e-6
code 0 "$BIN/hslt-compare" a.exr again.exr --max-relmse 0 --json
grep -q '"relMSE":0.0,.*"psnr":null' out || fail "--json says: $(cat out)"
code 1 "$BIN/hslt-compare" a.exr large.exr
grep -q -- --size err.log || fail "it does not say how: $(cat err.log)"
code 1 "$BIN/hslt-compare" a.exr large.exr --size 24x24
code 0 "$BIN/hslt-compare" a.exr large.exr --size 16x16 --heatmap heat.png --trim 0.01
grep -q '^left out  *2 of 256' out || fail "--trim says: $(cat out)"
code 0 "$BIN/hslt-tonemap" a.exr a.png --exposure -1
code 2 "$BIN/hslt-tonemap" a.exr a.png --exposure bright
code 2 "$BIN/hslt-tonemap" a.exr a.JPG && [ ! -e a.JPG ] || fail "a PNG has the name of another format"
code 2 "$BIN/hslt-tonemap" a.exr a.svg && [ ! -e a.svg ] || fail "a PNG has the name of an SVG"
grep -q 'a PNG file is written, so the name should end in .png' err.log || fail "a.JPG: $(cat err.log)"
# - means stdin or stdout, everywhere
code 0 "$BIN/hslt-tonemap" a.exr dash.png
"$BIN/hslt-tonemap" - - <a.exr 2>err.log | cmp - dash.png || fail "tonemap - -: $(cat err.log)"
"$BIN/hslt-render" box.xml -o - --integrator path --spp 4 --seed 1 --size 32x32 --threads 1 --quiet 2>err.log | "$BIN/hslt-tonemap" - piped.png ||
	fail "render | tonemap: $(cat err.log)"
cmp piped.png dash.png || fail "a pipe makes another picture"
cat a.exr | code 0 "$BIN/hslt-compare" --exact - again.exr
cat a.exr | code 1 "$BIN/hslt-compare" --exact other.exr -
code 2 "$BIN/hslt-compare" --exact - -
printf x | code 1 "$BIN/hslt-tonemap" - piped.png
"$BIN/hslt-assemble" a.exr -o - 2>err.log >whole.exr && code 0 "$BIN/hslt-tonemap" whole.exr piped.png && cmp piped.png dash.png ||
	fail "assemble -o -: $(cat err.log)"
rm dash.png piped.png
# and is named so in messages
for c in "hslt-render box.xml -o - -i path --spp 1 --size 8x8 --quiet" "hslt-tonemap a.exr -" "hslt-assemble a.exr -o -"; do
	! "$BIN/"$c >/dev/full 2>err.log || fail "$c: a full disk holds it"
	grep -q ': stdout: .*No space left' err.log && ! grep -q /dev/stdout err.log || fail "$c on a full disk: $(cat err.log)"
done
code 0 "$BIN/hslt-render" box.xml -o dash.exr -i path --spp 1 --size 8x8 --quiet --stats - && grep -q '"schema"' out && [ ! -e - ] ||
	fail "--stats -: $(cat out)"
code 1 "$BIN/hslt-render" box.xml -o - -i path --spp 1 --size 8x8 --quiet --stats -
grep -q 'are the same file, stdout' err.log || fail "-o - --stats -: $(cat err.log)"
for one in /dev/fd/1 /proc/self/fd/1; do
	code 1 "$BIN/hslt-render" box.xml -o - -i path --spp 1 --size 8x8 --quiet --stats $one
	grep -q "are the same file" err.log || fail "-o - --stats $one: $(cat err.log)"
done
"$BIN/hslt-render" box.xml -o - -i path --spp 1 --size 8x8 --quiet --stats /dev/fd/1 2>err.log | cat >piped.out
[ ! -s piped.out ] && grep -q "are the same file" err.log || fail "-o - --stats /dev/fd/1 into a pipe: $(cat err.log)"
code 0 "$BIN/hslt-accuracy" box.xml -o - --parameters tolerance --rounds 2 --size 8x8 --epoch 1 --quiet && grep -qi '^<!doctype html' out && [ ! -e - ] ||
	fail "hslt-accuracy -o -: $(head -n 3 out)"
code 2 "$BIN/hslt-compare" a.exr again.exr --heatmap -
code 2 "$BIN/hslt-compare" a.exr again.exr --heatmap /dev/stdout
rm dash.exr
# A target that is no regular file is written to and stays; of a link the file that it leads to is replaced.
code 0 "$BIN/hslt-tonemap" a.exr b.png --exposure -1
"$BIN/hslt-tonemap" a.exr /dev/stdout --exposure -1 2>err.log | cmp - b.png || fail "/dev/stdout: $(cat err.log)"
{ printf before && "$BIN/hslt-tonemap" a.exr /dev/stdout --exposure -1 2>err.log; } >after.png
{ printf before && cat b.png; } | cmp - after.png || fail "/dev/stdout that is a file is written from its beginning"
mkfifo pipe && { cmp pipe b.png & } && code 0 "$BIN/hslt-tonemap" a.exr pipe --exposure -1
wait "$!" && [ -p pipe ] || fail "a pipe does not stay one"
[ -L link.exr ] && [ -f folder/real.exr ] && [ -c /dev/null ] || fail "a link or a device does not stay one"
code 0 "$BIN/hslt-compare" --exact a.exr folder/real.exr
rm b.png after.png
code 1 "$BIN/hslt-tonemap" a.exr none/a.png
[ "$(ls -1 ./*.png* | tr '\n' ' ')" = "./a.png ./heat.png " ] || fail "files: $(ls)"
# 8 bytes of signature, then IHDR with the size
[ "$(od -An -tx1 -j0 -N8 a.png | tr -d ' ')" = 89504e470d0a1a0a ] || fail "a.png is no PNG"
[ "$(od -An -tx1 -j16 -N8 heat.png | tr -d ' ')" = 0000001000000010 ] || fail "heat.png is not 16x16"

# kept FILE SENTENCE COMMAND...: the command fails, gives the reason, and leaves the file as it was
kept() {
	file=$1 sentence=$2
	shift 2
	cp "$file" before
	code 1 "$@"
	grep -q -- "$sentence" err.log || fail "$* says: $(cat err.log)"
	cmp "$file" before || fail "$* has changed $file"
}
ln -s scene.xml link.xml
ln -s a.exr link.png
ln -s again.exr again.png
kept scene.xml 'which is an input' "$BIN/hslt-render" scene.xml -o scene.xml
kept scene.xml 'which is an input' "$BIN/hslt-render" link.xml -o link.xml
kept scene.xml 'scene.xml exists and is not an OpenEXR file' "$BIN/hslt-render" box.xml -o scene.xml
kept scene.xml 'not a file of statistics' "$BIN/hslt-render" box.xml -o new.exr --stats scene.xml
kept scene.xml 'are the same file' "$BIN/hslt-render" scene.xml -o new --stats ./new
kept a.exr 'which is an input' "$BIN/hslt-compare" a.exr other.exr --heatmap link.png
kept again.exr 'not a PNG file' "$BIN/hslt-compare" a.exr other.exr --heatmap again.png
kept a.exr 'which is an input' "$BIN/hslt-assemble" a.exr -o ./a.exr
kept scene.xml 'not an OpenEXR file' "$BIN/hslt-assemble" a.exr -o scene.xml
kept link.png "which is an input" "$BIN/hslt-tonemap" a.exr link.png
kept scene.xml 'not a PNG file' "$BIN/hslt-tonemap" a.exr scene.xml
kept scene.xml 'not an HTML file' "$BIN/hslt-accuracy" box.xml -o scene.xml
kept scene.xml 'are the same file' "$BIN/hslt-accuracy" scene.xml -o r --csv r
kept scene.xml 'which is an input' "$BIN/hslt-submit" -c 127.0.0.1:1 scene.xml -o scene.xml --wait
# a file that the scene names counts as an input, too
cp other.exr sky.exr
cp other.exr lamp.exr
sed 's|</scene>|<emitter type="envmap"><string name="filename" value="sky.exr"/></emitter></scene>|' box.xml >sky.xml
kept sky.exr 'would replace sky.exr, which is an input' "$BIN/hslt-render" sky.xml -o sky.exr
kept sky.exr 'would replace sky.exr, which is an input' "$BIN/hslt-submit" -c 127.0.0.1:1 sky.xml -o sky.exr --wait
code 0 "$BIN/hslt-render" sky.xml -o lamp.exr --integrator path --spp 4 --size 8x8 --quiet --stats s.json
code 0 "$BIN/hslt-render" sky.xml -o lamp.exr --integrator path --spp 4 --size 8x8 --quiet --stats s.json
echo "compare and tonemap: exit codes and files"
