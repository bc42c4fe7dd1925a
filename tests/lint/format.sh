# SPDX-License-Identifier: Apache-2.0
# Each source is formatted by .clang-format (`make format`), has no overlong lines, names its licence and, if it is long, begins with a
# comment. Only clang-format 14 counts, because versions format differently. clang-format never breaks a string, and moves what follows a
# macro among strings to the right: such scenes are files (tests/scenes), or formatted by hand.
cd "$(dirname "$0")/../.." || exit 1
sources=$(git ls-files '*.[ch]' '*.inc' 2> /dev/null || find common coordinator worker tests -name '*.[ch]' -o -name '*.inc')
sources=$(echo "$sources" | grep -v /data/)
scripts=$(git ls-files Makefile .ci deploy '*.mk' '*.sh' '*.py' '*.awk' '*.dict' '*.proto' 2>/dev/null | grep -v '\.md$')
unnamed=$(echo "$sources $scripts" | xargs grep -L 'SPDX-License-Identifier: Apache-2.0')
if [ -n "$unnamed" ]; then
	echo "WRONG: no line SPDX-License-Identifier: Apache-2.0"
	echo "$unnamed" | sed 's/^/	/'
	exit 1
fi
echo "ok: each source names its licence"
silent=$(echo "$sources" | xargs awk '
	FNR == 2 { opens = /^\/[*\/]/ }
	FNR == 201 && !opens { print FILENAME }')
if [ -n "$silent" ]; then
	echo "WRONG: more than 200 lines, and no comment at the top that says what it does"
	echo "$silent" | sed 's/^/	/'
	exit 1
fi
echo "ok: each source above 200 lines opens with a comment"
# 120 columns, as in .clang-format. It never breaks a string, so lines with a string, and macros of strings, may have 140.
wide=$(echo "$sources" | LC_ALL=C xargs awk -v most=120 -v most_with_text=140 '
	{
		line = $0
		if (length(line) + 7 * gsub(/\t/, "\t", line) <= most)
			next
		while ((at = index(line, "\t")) > 0)
			line = substr(line, 1, at - 1) substr("        ", (at - 1) % 8 + 1) substr(line, at + 1)
		if (length(line) > (line ~ /"|\\$/ ? most_with_text : most))
			print FILENAME ":" FNR ": " length(line) " columns"
	}')
if [ -n "$wide" ]; then
	echo "WRONG: lines of more than 120 columns with tabs of 8, or 140 with a string (a scene without parameters can be a file in tests/scenes)"
	echo "$wide" | sed 's/^/	/'
	exit 1
fi
echo "ok: no line has more than 120 columns, or 140 with a string"
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
