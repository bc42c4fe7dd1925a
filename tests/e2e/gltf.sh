# SPDX-License-Identifier: Apache-2.0
# A glTF scene with separate files, embedded and as .glb gives one picture: that of the same scene in XML, in
# hslt-render and on a farm, and nearly that of gltfpack's version of it; a normal map acts like a tilted surface.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-job hslt-render hslt-compare hslt-scene

python3 tests/e2e/gltf.py "$DIR"

# picture NAME SCENE OPTION...: renders NAME.exr
picture() {
	name=$1 scene=$2
	shift 2
	"$BIN/hslt-render" "$DIR/$scene" -o "$DIR/$name.exr" --size 72x48 --quiet "$@" 2>/dev/null
}

# near A B PERCENT: checks the relative error between two images
near() {
	"$BIN/hslt-compare" --json "$DIR/$1.exr" "$DIR/$2.exr" >"$DIR/near"
	awk -F'"relativeError":' -v most="$3" '{ split($2, x, /[,}]/); e = 100 * x[1]; found = NF > 1 }
		END { print e " %"; exit !(found && e <= most) }' "$DIR/near" || fail "$1 and $2: $(cat "$DIR/near")"
}

for form in files.gltf embedded.gltf one.glb twin.xml; do
	code 0 "$BIN/hslt-scene" check "$DIR/$form"
	picture "$form" "$form" --integrator path --spp 64 --set backs=lit
done
near files.gltf embedded.gltf 0
near files.gltf one.glb 0
near files.gltf twin.xml 0.01

picture map map.glb --integrator path --spp 16
picture normals normals.glb --integrator path --spp 16
near map normals 0.01

# written by another program on a grid of 2^16 points, which moves edges by a little; compressed, without and with
# filters
command -v gltfpack >/dev/null || lacks "gltfpack"
for form in grid packed:-c filtered:-cc; do
	name=${form%:*} how=${form#"$name"}
	gltfpack -vp 16 -vt 16 -vn 16 ${how#:} -i "$DIR/one.glb" -o "$DIR/$name.gltf" >/dev/null
	picture "$name" "$name.gltf" --integrator path --spp 64 --set backs=lit
done
for word in EXT_meshopt_compression KHR_mesh_quantization KHR_texture_transform OCTAHEDRAL; do
	grep -q "$word" "$DIR/filtered.gltf" || fail "gltfpack wrote no $word"
done
near grid one.glb 10
near packed grid 0.01
near filtered grid 2

# on a farm, whose workers have only the files that they were sent
start_coordinator -v
start_worker one --threads 1
for form in files.gltf one.glb packed.gltf; do
	picture quiet "$form" --integrator bdpt --spp 8
	"$BIN/hslt-submit" "$DIR/$form" -o "$DIR/farm.exr" --size 72x48 --integrator bdpt --spp 8 --wait >/dev/null
	same "$DIR/farm.exr" "$DIR/quiet.exr"
done

# errors have their line; unsupported features are left out if asked for
prism='"KHR_materials_transmission": {"transmissionFactor": 0.5}, "KHR_materials_dispersion": {"dispersion": 1}'
sed "s/\"alphaMode\": \"BLEND\"/\"alphaMode\": \"BLEND\", \"extensions\": {$prism}/" "$DIR/files.gltf" >"$DIR/prism.gltf"
code 0 "$BIN/hslt-scene" check "$DIR/prism.gltf"
grep -q 'KHR_materials_dispersion of other materials is left out' "$DIR/out" || fail "$(cat "$DIR/out")"
sed -i 's/^{/{"extensionsRequired": ["KHR_materials_dispersion"],/' "$DIR/prism.gltf"
code 1 "$BIN/hslt-scene" check "$DIR/prism.gltf"
grep -q 'prism.gltf:[1-9][0-9]*: .*`dispersion` is not supported' "$DIR/out" || fail "$(cat "$DIR/out")"
code 0 "$BIN/hslt-scene" check --lenient "$DIR/prism.gltf"
grep -q 'dispersion` is not supported and left out' "$DIR/out" || fail "$(cat "$DIR/out")"
