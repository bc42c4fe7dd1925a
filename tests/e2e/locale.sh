# SPDX-License-Identifier: Apache-2.0
# In a locale with decimal commas the build makes the same tables from its data.
. "$(dirname "$0")/lib.sh"
ROOT=$HERE/../..
TABLES="cie_observer cie_d65 wavelength_cells wavelength_guide conductors"
[ -e /usr/share/i18n/locales/de_DE ] || lacks "no locales (deploy/setup.sh --full installs them)"
localedef -i de_DE -f UTF-8 "$DIR/de_DE.UTF-8" >"$DIR/localedef.log" 2>&1 || fail "no locale: $(tail -n 1 "$DIR/localedef.log")"
export LOCPATH="$DIR" LC_ALL=de_DE.UTF-8
[ "$(locale decimal_point)" = , ] || fail "numbers have no commas, this tests nothing"
for t in $TABLES; do
	(cd "$ROOT" && "${MAKE:-make}" -s BUILD="$DIR/build" "$DIR/build/gen/$t.inc") >"$DIR/make.log" 2>&1 || fail "$t: $(tail -n 3 "$DIR/make.log")"
	cmp "$BUILD/gen/$t.inc" "$DIR/build/gen/$t.inc" || fail "$t is another table"
done
echo "the same tables where numbers have commas"
