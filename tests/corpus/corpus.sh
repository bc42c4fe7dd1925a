# SPDX-License-Identifier: Apache-2.0
# Tries every scene file under a folder: `sh corpus.sh HSLT-SCENE FOLDER [OPTION...]` (make corpus DIR=FOLDER). Options go to
# hslt-scene check: --lenient. XML without a <scene>, and those that others include, are no scenes. Prints how many load, what
# refuses the others first, and how often. Exit code 1 when one crashed or took more than LIMIT (60) seconds.
set -u
scene=$1 folder=$2
shift 2
[ -d "$folder" ] || { echo "corpus: '$folder' is no folder (make corpus DIR=FOLDER)" >&2; exit 2; }
work=$(mktemp -d) && trap 'rm -rf "$work"' EXIT
find "$folder" -type f \( -name "*.xml" -o -name "*.gltf" -o -name "*.glb" \) | sort >"$work/all"
: >"$work/reasons" && : >"$work/bad"
loaded=0 tried=0
while IFS= read -r file; do
	case $file in *.xml) grep -q '<scene' "$file" && grep -q '<\(sensor\|camera\)' "$file" || continue ;; esac
	tried=$((tried + 1))
	timeout "${LIMIT:-60}" "$scene" check "$@" "$file" >"$work/out" 2>&1
	rc=$?
	case $rc in
	0) loaded=$((loaded + 1)) ;;
	1) # The first complaint without its place, numbers and the list of what is supported.
		grep -v '^note: ' "$work/out" | head -n 1 |
			sed 's/^hslt-scene: //; s/^[^ ]*:[0-9]*: //; s/ (supported: .*//; s/; supported: .*//; s/"[^"]*\.[a-zA-Z]*"/FILE/g; s/[-+]*[0-9.][0-9.e+-]*/N/g' |
			cut -c1-110 >>"$work/reasons" ;;
	*) echo "$file: exit code $rc" >>"$work/bad" ;;
	esac
done <"$work/all"
echo "$loaded of $tried scenes load"
sort "$work/reasons" | uniq -c | sort -rn
[ -s "$work/bad" ] || exit 0
echo "crashed or took too long:"
cat "$work/bad"
exit 1
