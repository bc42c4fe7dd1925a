# A crowd of fake workers over TLS: nothing lost, nothing counted twice. How fast it is, is for make load.
BUILD=${1:-build}
[ -x "$BUILD/load/load" ] || { echo "skipped: $BUILD/load/load is not built"; exit 77; }
exec "$BUILD/load/load" --bin "$BUILD/bin" --spool "${TMPDIR:-/tmp}" --workers 150 --size 128x72 --groups 8 --parts 16 --interval 2 \
	--minutes 0.1 --ramp 100 --losses
