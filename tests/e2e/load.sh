# SPDX-License-Identifier: Apache-2.0
# A crowd of fake workers over TLS, some of which die, send wrong results, hoard leases or hang: no result is lost,
# counted twice, or wrong. Its speed is measured by make load.
BUILD=${1:-build}
[ -x "$BUILD/load/load" ] || { echo "skipped: $BUILD/load/load is not built"; exit 77; }
exec "$BUILD/load/load" --bin "$BUILD/bin" --spool "${TMPDIR:-/tmp}" --workers 150 --size 128x72 --groups 8 --parts 16 --interval 2 \
	--minutes 0.1 --ramp 100 --dying 5 --lying 5 --hoarding 5 --hanging 5 --losses
