# SPDX-License-Identifier: Apache-2.0
# Each function with external linkage is used by another source, of the product or the tests. Otherwise it should be static, or it is
# dead code.
cd "$(dirname "$0")/../.." || exit 1
build=${1:-build}
objects=$(git ls-files 'common/*.c' 'coordinator/*.c' 'worker/*.c' 'tests/*.c' 2> /dev/null | sed "s|^|$build/obj/|; s|c\$|o|")
# shellcheck disable=SC2086 # a name for each object
objects=$(ls $objects 2> /dev/null)
case $objects in
*"$build/obj/coordinator/main.o"*) ;;
*) echo "nothing is built in $build" && exit 77 ;;
esac
# OBJECT:NAME for each function defined (T) or needed (U)
unused=$(echo "$objects" | xargs nm -A | awk '
	{ object = $1; sub(/:[^:]*$/, "", object); name = $NF; kind = $(NF - 1) }
	kind == "T" && object !~ /\/obj\/tests\// && name != "main" { home[name] = object }
	kind == "U" { needed[name] = 1 }
	END { for (name in home) if (!(name in needed)) print home[name] ": " name }' | sed "s|^$build/obj/||" | sort)
if [ -n "$unused" ]; then
	echo "WRONG: nobody else calls these: make them static, or remove them"
	echo "$unused" | sed 's/^/	/'
	exit 1
fi
echo "ok: each function that a source offers is called by another"
