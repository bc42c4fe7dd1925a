#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Runs every command of the ```sh blocks of the README and of docs/ in order, as a reader would type them, in a folder
# and at a port of its own. The two commands above these blocks have tests of their own: demo.sh, and the run that this
# test belongs to.
. "$(dirname "$0")/lib.sh"
need hslt-ca hslt-coordinator hslt-worker hslt-submit hslt-status hslt-job hslt-render hslt-compare hslt-tonemap
ROOT=$(cd "$HERE/../.." && pwd)
for command in deploy/demo.sh deploy/test.sh deploy/workers.sh; do
	cat "$ROOT/README.md" "$ROOT/docs/farm.md" | grep -q "sh $command" && [ -f "$ROOT/$command" ] || fail "$command is not both in the README or docs/farm.md and there"
done
head -n 9 "$ROOT/README.md" | grep -q '](docs/compatibility.md)' || fail "the README does not begin with what is supported"
# Links of the first pages lead to existing targets.
for page in "$ROOT/README.md" "$ROOT"/docs/*.md; do
	for link in $(grep -o '](\([^)#]*\)' "$page" | sed 's/^](//' | grep -v '^http' | sort -u); do
		[ -e "$(dirname "$page")/$link" ] || fail "$page: there is no $link"
	done
done
# Files that deploy/README.md names exist.
for f in $(grep -o '`[a-z]*/`\|tests/e2e/[a-z]*\.sh\|deploy/[a-z]*/*[A-Za-z]*\.[a-z]*' "$ROOT/deploy/README.md" | tr -d '`' | sort -u); do
	[ -e "$ROOT/$f" ] || [ -e "$ROOT/deploy/$f" ] || fail "deploy/README.md: there is no $f"
done
free_ports 2
safe=$((port + 1))
mkdir "$DIR/home"
ln -s "$ROOT/tests" "$DIR/home/tests"
mkdir -p "$DIR/home/build"
ln -s "$(cd "$BIN" && pwd)" "$DIR/home/build/bin"
{
	echo 'set -eu'
	echo 'RUNNING='
	echo "trap 'code=\$?; kill \$RUNNING; wait; exit \$code' EXIT"
	echo 'answers() { for k in $(seq 600); do ! hslt-job "$@" list >/dev/null 2>&1 || return 0; sleep 0.1; done; false; }'
	# make has nothing to build here, but must not fail. A reader pauses between two lines; here the test waits.
	awk '/^```sh$/ { on = 1; next } /^```$/ { on = 0 } on' "$ROOT/README.md" "$ROOT"/docs/*.md |
		sed -e "s/7700/$port/g" -e "s|^make -s\$|make -s -C '$ROOT' programs|" -e 's/ &$/ \& RUNNING="$RUNNING $!"/' \
			-e "/name two /a answers --coordinator 127.0.0.1:$port" \
			-e "/node1 --threads 1 &/a answers --coordinator 127.0.0.1:$safe --tls farm-ca/ann" -e "s/7701/$safe/g"
} >"$DIR/commands"
[ "$(wc -l <"$DIR/commands")" -gt 12 ] || fail "the README has lost its commands"
(cd "$DIR/home" && sh "$DIR/commands") >"$DIR/readme.log" 2>&1 || fail "a command of the README failed"
for f in demo.exr demo.png farm.exr safe.exr; do
	[ -s "$DIR/home/$f" ] || fail "the README's commands left no $f"
done
echo "$(grep -c . "$DIR/commands") lines run"
