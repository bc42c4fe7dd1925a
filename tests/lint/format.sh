# SPDX-License-Identifier: Apache-2.0
# Each source is laid out as .clang-format says (`make format` does it) and names its licence. Other versions of clang-format lay out
# otherwise, so only one counts.
cd "$(dirname "$0")/../.." || exit 1
sources=$(git ls-files '*.[ch]' '*.inc' 2> /dev/null || find common coordinator worker tests -name '*.[ch]' -o -name '*.inc')
sources=$(echo "$sources" | grep -v /data/)
unnamed=$(echo "$sources" | xargs grep -L 'SPDX-License-Identifier: Apache-2.0')
if [ -n "$unnamed" ]; then
	echo "WRONG: no line SPDX-License-Identifier: Apache-2.0"
	echo "$unnamed" | sed 's/^/	/'
	exit 1
fi
echo "ok: each source names its licence"
silent=$(for f in $sources; do
	[ "$(wc -l < "$f")" -le 200 ] || sed -n 2p "$f" | grep -qE '^/[*/]' || echo "$f"
done)
if [ -n "$silent" ]; then
	echo "WRONG: more than 200 lines, and no comment at the top that says what it does"
	echo "$silent" | sed 's/^/	/'
	exit 1
fi
echo "ok: each source above 200 lines opens with a comment"
format=$(command -v clang-format-14 || command -v clang-format)
if ! "${format:-false}" --version 2> /dev/null | grep -q 'version 14\.'; then
	echo "clang-format 14 is not installed"
	exit 77
fi
wrong=$(echo "$sources" | xargs "$format" --dry-run --style=file 2>&1 | sed -n 's/: warning: .*//p')
if [ -n "$wrong" ]; then
	echo "WRONG: not laid out as .clang-format says (make format)"
	echo "$wrong" | sed 's/^/	/'
	exit 1
fi
echo "ok: laid out as .clang-format says"
