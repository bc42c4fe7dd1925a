# SPDX-License-Identifier: Apache-2.0
# The headers of images, read without the library that writes them: the primaries and the white point of the colours,
# the program, the camera. Images of hslt-render, of the farm, previews and assembled crops.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-job hslt-render hslt-assemble

# says FILE: checks that the header has all three
says() {
	python3 "$HERE/exr_header.py" "$1" >"$DIR/header" || fail "$1 cannot be read: $(cat "$DIR/header")"
	# Rec. 709: red, green, blue and D65 (ITU-R BT.709-6, section 1)
	grep -qx 'chromaticities chromaticities 0.64 0.33 0.3 0.6 0.15 0.06 0.3127 0.329' "$DIR/header" ||
		fail "the colours of $1: $(grep '^chroma' "$DIR/header")"
	grep -q "^software string HSLT Farm $VERSION" "$DIR/header" || fail "the program of $1: $(grep '^software' "$DIR/header")"
	grep -q '^hslt:camera string .*fov=[0-9.]* .*to_world=' "$DIR/header" || fail "the camera of $1: $(grep '^hslt:camera' "$DIR/header")"
}
VERSION=$("$BIN/hslt-render" --version | sed -n '1s/.* \([0-9][0-9.]*\).*/\1/p')
[ -n "$VERSION" ] || fail "no version: $("$BIN/hslt-render" --version)"

"$BIN/hslt-render" "$BOX" -o "$DIR/left.exr" -i path --size 16x16 --spp 16 --crop 0,0,8,16 --quiet
"$BIN/hslt-render" "$BOX" -o "$DIR/right.exr" -i path --size 16x16 --spp 16 --crop 8,0,8,16 --quiet
says "$DIR/left.exr"
"$BIN/hslt-assemble" "$DIR/left.exr" "$DIR/right.exr" -o "$DIR/both.exr"
says "$DIR/both.exr"

start_coordinator
start_worker w1
id=$(submit "$BOX" -o "$DIR/farm.exr" -i path --size 16x16 --spp 1000000)
running() {
	"$BIN/hslt-job" fetch "$id" --preview -o "$DIR/farm.exr" 2>"$DIR/fetch.log"
}
until_true 20 running || fail "no preview: $(cat "$DIR/fetch.log")"
says "$DIR/farm.preview.exr"
"$BIN/hslt-job" cancel "$id"
submit "$BOX" -o "$DIR/farm.exr" -i path --size 16x16 --spp 16 --wait >"$DIR/id"
says "$DIR/farm.exr"
echo "headers: colours, program, camera"
