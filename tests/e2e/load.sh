# SPDX-License-Identifier: Apache-2.0
# A crowd of fake workers over TLS, of whom some die, lie, hoard and hang: nothing lost, nothing counted twice, nothing wrong counted. How fast it is, is for make load.
BUILD=${1:-build}
[ -x "$BUILD/load/load" ] || { echo "skipped: $BUILD/load/load is not built"; exit 77; }
exec "$BUILD/load/load" --bin "$BUILD/bin" --spool "${TMPDIR:-/tmp}" --workers 150 --size 128x72 --groups 8 --parts 16 --interval 2 \
	--minutes 0.1 --ramp 100 --dying 5 --lying 5 --hoarding 5 --hanging 5 --losses
