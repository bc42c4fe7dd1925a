# SPDX-License-Identifier: Apache-2.0
# Each link of a Markdown page leads to an existing file and heading. Pages of docs/ that sources cite exist as well.
cd "$(dirname "$0")/../.." || exit 1
pages=$(git ls-files '*.md' 2> /dev/null || find . -name '*.md')
if ! broken=$(echo "$pages" | xargs python3 tests/lint/links.py); then
	echo "WRONG: links that lead nowhere"
	echo "$broken" | sed 's/^/	/'
	exit 1
fi
echo "ok: links of all pages lead somewhere"
missing=$(git ls-files '*.[ch]' '*.sh' '*.py' '*.proto' '*.inc' Makefile | xargs grep -oh '\bdocs/[A-Za-z_]*\.md' | sort -u | while read -r f; do
	[ -e "$f" ] || echo "$f"
done)
if [ -n "$missing" ]; then
	echo "WRONG: sources cite pages that are not there"
	echo "$missing" | sed 's/^/	/'
	exit 1
fi
echo "ok: pages that sources cite are there"
