# SPDX-License-Identifier: Apache-2.0
# `make install` into a folder: the programs run from there, each has its manual page and its completion, the units of systemd start
# programs that are among them, and `make uninstall` leaves nothing behind.
. "$(dirname "$0")/lib.sh"
ROOT=$(cd "$HERE/../.." && pwd)
TREE=$DIR/root/usr/local
# The build stays as it is, whatever options it was built with: no program is built again.
built=
for program in "$BIN"/hslt-*; do
	built="$built -o $program"
done
by_make() {
	make -s -C "$ROOT" $built BUILD="$BUILD" DESTDIR="$DIR/root" PREFIX=/usr/local "$1" >"$DIR/make.log" 2>&1 || fail "make $1: $(cat "$DIR/make.log")"
}
by_make install

count=0
for program in "$BIN"/hslt-*; do
	name=$(basename "$program")
	count=$((count + 1))
	cmp -s "$program" "$TREE/bin/$name" && [ -x "$TREE/bin/$name" ] || fail "$name is not installed"
	"$TREE/bin/$name" --version | grep -q "^$name " || fail "$name --version: $("$TREE/bin/$name" --version)"
	"$TREE/bin/$name" --man | cmp -s - "$TREE/share/man/man1/$name.1" || fail "the manual page of $name is not what it prints"
	"$TREE/bin/$name" --completion | cmp -s - "$TREE/share/bash-completion/completions/$name" || fail "the completion of $name is not what it prints"
done
[ "$count" -ge 12 ] || fail "only $count programs"
[ "$(find "$DIR/root" -type f | wc -l)" -eq $((3 * count)) ] || fail "other files are installed: $(find "$DIR/root" -type f)"

started=$(sed -n 's|^ExecStart=/usr/local/bin/\([a-z-]*\) .*|\1|p' "$ROOT"/deploy/systemd/*.service)
[ "$(echo "$started" | wc -l)" -eq "$(ls "$ROOT"/deploy/systemd/*.service | wc -l)" ] || fail "a unit starts something else: $started"
for name in $started; do
	[ -x "$TREE/bin/$name" ] || fail "a unit starts $name, which is not installed"
done

cp -r "$(dirname "$BOX")" "$DIR/scene"
(cd "$DIR/scene" && PATH=$TREE/bin:$PATH && hslt-render "$(basename "$BOX")" -o box.exr --size 16 --spp 1 --threads 1 --integrator path --quiet &&
	hslt-tonemap box.exr box.png && hslt-compare --exact box.exr box.exr) >"$DIR/render.log" 2>&1 || fail "what is installed does not render"
[ -s "$DIR/scene/box.png" ] || fail "no picture"

by_make uninstall
[ -z "$(find "$DIR/root" -type f)" ] || fail "uninstall leaves $(find "$DIR/root" -type f)"
