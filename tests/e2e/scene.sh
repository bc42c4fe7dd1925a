# hslt-scene: everything that is wrong with a file in one run; what was read of a good one.
. "$(dirname "$0")/lib.sh"
need hslt-scene hslt-render

code 0 "$BIN/hslt-scene" --help
grep -qi example "$DIR/out" || fail "--help has no examples"
code 2 "$BIN/hslt-scene" look "$BOX"
code 2 "$BIN/hslt-scene" check
code 1 "$BIN/hslt-scene" check "$DIR/none.xml"

cat >"$DIR/bad.xml" <<'XML'
<scene version="3.0.0">
<integrator type="volpath"><integer name="rr_depth" value="5"/></integrator>
<sensor type="perspectiv"/>
<bsdf type="hair" id="fur"/>
<shape type="sphere">
	<ref id="fur"/>
	<float name="radios" value="1"/>
	<medium type="homogeneous" name="interior"/>
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
[ "$(grep -c 'type="hair"' "$DIR/out")" = 1 ] || fail "one unknown material is complained of more than once: $(cat "$DIR/out")"
grep -q "^bad.xml: 6 problems" "$DIR/out" || fail "it does not sum up: $(tail -n 1 "$DIR/out")"
code 1 "$BIN/hslt-render" "$DIR/bad.xml" -o "$DIR/bad.exr"
grep -q "bad.xml:3.*and 5 more: hslt-scene check lists them" "$DIR/err.log" || fail "a render says: $(cat "$DIR/err.log")"

# What the reader cannot see by itself.
sed 's/filename" value="[^"]*"/filename" value="gone.obj"/' "$BOX" >"$DIR/gone.xml"
if grep -q gone.obj "$DIR/gone.xml"; then
	code 1 "$BIN/hslt-scene" check "$DIR/gone.xml"
	grep -qi "gone.xml:[0-9]*: .*gone.obj: no such file" "$DIR/out" || fail "a missing mesh: $(cat "$DIR/out")"
fi

code 0 "$BIN/hslt-scene" check "$BOX"
grep -q "^box.xml: can be rendered: [0-9]* shapes" "$DIR/out" || fail "of a good scene it says: $(cat "$DIR/out")"
code 0 "$BIN/hslt-scene" show "$BOX"
sum=$(sha256sum "$BOX" | cut -c1-16)
grep -q "^$sum .* box.xml$" "$DIR/out" || fail "show has no file box.xml with its hash: $(cat "$DIR/out")"
code 0 "$BIN/hslt-scene" show --json "$BOX"
grep -q "\"schema\":1.*\"sha256\":\"$(sha256sum "$BOX" | cut -d' ' -f1)\"" "$DIR/out" || fail "--json says: $(cat "$DIR/out")"
echo "check and show: all problems with their places, and what a good scene holds"
