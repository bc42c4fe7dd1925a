# SPDX-License-Identifier: Apache-2.0
# Nothing gets into the repository by accident: the top folder contains only the files named here, and no folder contains packages,
# objects, archives or dumps. Without git (an unpacked archive) there is nothing to check.
cd "$(dirname "$0")/../.." || exit 1
if ! files=$(git ls-files 2>/dev/null) || [ -z "$files" ]; then
	echo "ok: not a git checkout, tracked files are not looked at"
	exit 0
fi
wrong=$(printf '%s\n' "$files" | grep -v / |
	grep -vxE '\.ci|\.clang-format|\.gitignore|CHANGELOG\.md|CONTRIBUTING\.md|LICENSE|Makefile|README\.md')
more=$(printf '%s\n' "$files" | grep -iE '\.(deb|rpm|o|a|so|zip|t?gz|xz|zst|log|out|orig|rej|swp|core)$')
wrong=$(printf "%s\n%s\n" "$wrong" "$more" | sort -u | sed "/^$/d")
if [ -n "$wrong" ]; then
	echo "WRONG: files that do not belong in the repository"
	printf '%s\n' "$wrong" | sed 's/^/	/'
	exit 1
fi
echo "ok: no stray file is tracked"
