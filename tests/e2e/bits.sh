# SPDX-License-Identifier: Apache-2.0
# 1, 2 and 4 workers give the same bits as hslt-render: samples, chains, both directions, other settings, smoke, a crop
# that ends at its target error, a scene whose files lie outside its folder.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-render hslt-compare

options_of() {
	case $1 in
	path) echo "--integrator path --spp 16" ;;
	bdpt) echo "--integrator bdpt --spp 4" ;;
	bdpt8) echo "--integrator bdpt8 --spp 16" ;;
	erpt) echo "--integrator erpt --spp 8" ;;
	erpt4) echo "--integrator erpt4 --spp 8" ;;
	pssmlt) echo "--integrator pssmlt --bootstrap 20000 --mutations 60000" ;;
	hslt) echo "--integrator hslt --mutations hslt=0.9,independent=0.1 --bootstrap 20000 --mutations 60000" ;;
	settings) echo "--integrator hslt --bootstrap 5000 --mutations 20000 --set roughness=0.1,wavelengths=2 --set precision=single,tolerance=0.0001" ;;
	auto) echo "--spp 8 --seed 3" ;;
	smoke) echo "--integrator bdpt --spp 4 --size 64x48" ;;
	error) echo "--integrator path --crop 8,8,24,16 --target-error 4% --epoch 1 --spp 4096 --seed 7" ;;
	esac
}

scene_of() {
	if [ "$1" = smoke ]; then echo "${BOX%/*}/../smoke/scene.xml"; else echo "$BOX"; fi
}

KINDS="path bdpt bdpt8 erpt erpt4 pssmlt auto smoke"
if "$BIN/hslt-render" --help | grep -q 'integrator=NAME.* hslt'; then
	KINDS="$KINDS hslt settings"
fi
KINDS="$KINDS error"
for kind in $KINDS; do
	"$BIN/hslt-render" "$(scene_of $kind)" -o "$DIR/$kind.exr" $(options_of $kind) 2>>"$DIR/render.log" || fail "hslt-render: $kind"
done
if "$BIN/hslt-compare" --exact "$DIR/path.exr" "$DIR/bdpt.exr" >/dev/null 2>&1; then
	fail "path and bdpt cannot be equal: what compares does not look"
fi

grep -aq 'hslt:camera' "$DIR/path.exr" || fail "no camera in the header"

start_coordinator
started=0
for workers in 1 2 4; do
	while [ $started -lt $workers ]; do
		started=$((started + 1))
		start_worker "w$started"
	done
	until_true 10 sh -c "[ \$('$BIN/hslt-status' --json | grep -o '\"fingerprint\"' | wc -l) -eq $workers ]" ||
		fail "$workers workers do not show"
	for kind in $KINDS; do
		submit "$(scene_of $kind)" -o "$DIR/$kind-$workers.exr" $(options_of $kind) --wait >"$DIR/id" || fail "$kind: $?"
		same "$DIR/$kind.exr" "$DIR/$kind-$workers.exr"
	done
done
id=$(cat "$DIR/id")
# A scene whose file names lead out of its folder, to a folder given by --path.
mkdir -p "$DIR/place/sub" "$DIR/library"
cp "${BOX%/*}"/meshes/* "$DIR/library"
sed 's:"meshes/:"../library/none/../:' "$BOX" >"$DIR/place/box.xml"
sed 's:"meshes/:"sub/../../library/:' "$BOX" >"$DIR/place/odd.xml"
sed "s:\"meshes/:\"$DIR/library/:" "$BOX" >"$DIR/place/absolute.xml"
code 1 "$BIN/hslt-submit" "$DIR/place/box.xml" -o "$DIR/none.exr" --integrator path --spp 1
grep -q -- "--path $DIR\$" "$DIR/err.log" || fail "names outside: $(cat "$DIR/err.log")"
"$BIN/hslt-render" "$DIR/place/box.xml" --path "$DIR/library" -o "$DIR/place.exr" --integrator path --spp 1 2>>"$DIR/render.log" ||
	fail "hslt-render with names outside"
for scene in box odd absolute; do
	submit "$DIR/place/$scene.xml" --path "$DIR/library" -o "$DIR/place-$scene.exr" --integrator path --spp 1 --wait >"$DIR/placed" ||
		fail "names outside: $?"
done
same "$DIR/place.exr" "$DIR/place-box.exr"
for scene in odd absolute; do
	code 0 "$BIN/hslt-compare" "$DIR/place.exr" "$DIR/place-$scene.exr"
	grep -q "^relMSE  *0 " "$DIR/out" || fail "the same file by another name is another image: $(cat "$DIR/out")"
done

# The header has all options that render the image again, and the hash of its scene; the farm writes the same.
GIVEN="-D light=3 --path $DIR/library --integrator path --spp 2 --size 16x12"
mkdir "$DIR/with blank"
"$BIN/hslt-render" "$DIR/place/box.xml" $GIVEN --path "$DIR/with blank" -o "$DIR/given.exr" --stats "$DIR/given.json" --quiet || fail "with options: $?"
submit "$DIR/place/box.xml" $GIVEN --path "$DIR/with blank" -o "$DIR/given-farm.exr" --wait >"$DIR/placed" || fail "with options on the farm: $?"
same "$DIR/given.exr" "$DIR/given-farm.exr"
options=$(sed -n 's/^ *"options": "\(.*\)",$/\1/p' "$DIR/given.json")
grep -aqF -e "$options" "$DIR/given.exr" || fail "the header has other options than --stats: $options"
grep -aqF "$(sha256sum "$DIR/place/box.xml" | cut -d ' ' -f 1)" "$DIR/given.exr" || fail "the header does not have the scene's hash"
eval "set -- $options"
"$BIN/hslt-render" "$DIR/place/box.xml" "$@" -o "$DIR/given-again.exr" --quiet || fail "the header's options: $options"
same "$DIR/given.exr" "$DIR/given-again.exr"

[ "$(value "$id" reason)" = error ] || fail "$id ended by its $(value "$id" reason)"
echo "equal bits for 1, 2 and 4 workers and hslt-render; the error was reached after $(value "$id" rounds) rounds"
