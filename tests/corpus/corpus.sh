# SPDX-License-Identifier: Apache-2.0
# Tries every scene file under a folder: `sh corpus.sh HSLT-SCENE FOLDER [OPTION...]` (make corpus DIR=FOLDER). Options
# (--lenient, --path) are passed to hslt-scene check. These XML files are not taken for scenes: files without a <scene>,
# files with neither a sensor nor an include, and files that others include. Prints how many scenes load, and for the
# others the first error, with the number of scenes that have it; with ALL=1 every error. The exit code is 1 if
# hslt-scene crashed or took more than LIMIT (60) seconds.
set -u
scene=$1 folder=$2
shift 2
[ -d "$folder" ] || { echo "corpus: '$folder' is no folder (make corpus DIR=FOLDER)" >&2; exit 2; }
work=$(mktemp -d) && trap 'rm -rf "$work"' EXIT
find "$folder" -type f \( -name "*.xml" -o -name "*.gltf" -o -name "*.glb" \) | sort >"$work/all"
: >"$work/reasons" && : >"$work/bad"
# Files that others include. Names are relative to the scene's folder, which may be the parent of an included file's
# folder; $NAME may stand for anything.
while IFS= read -r file; do
	here=${file%/*}
	sed -n 's/.*<include[^>]*filename="\([^"]*\)".*/\1/p' "$file" | sed 's/\$[A-Za-z_0-9]*/*/g' |
		while IFS= read -r name; do
			find "$here" "${here%/*}" -path "$here/$name" -o -path "${here%/*}/$name"
		done
done <"$work/all" | sort -u >"$work/included"
# The first error of each scene, without place, numbers and the list of what is supported. The lines begin with the
# scene's folder.
reasons() {
	while IFS= read -r line; do
		printf '%s\n' "${line#"${file%/*}/"}"
	done <"$1" | grep -v -e '^note: ' -e ' problems\{0,1\}, ' |
		sed 's/^hslt-scene: //; s/^[^ ]*:[0-9]*: //; s/ (supported: .*//; s/; supported: .*//; s/"[^"]*\.[a-zA-Z]*"/FILE/g; s/[-+]*[0-9.][0-9.e+-]*/N/g' |
		cut -c1-110
}
loaded=0 tried=0
while IFS= read -r file; do
	case $file in *.xml) grep -q '<scene' "$file" && grep -q '<\(sensor\|camera\|include\)' "$file" || continue ;; esac
	grep -qxF "$file" "$work/included" && continue
	tried=$((tried + 1))
	timeout "${LIMIT:-60}" "$scene" check "$@" "$file" >"$work/out" 2>&1
	rc=$?
	case $rc in
	0) loaded=$((loaded + 1)) ;;
	1) if [ -n "${ALL:-}" ]; then reasons "$work/out" | sort -u; else reasons "$work/out" | head -n 1; fi >>"$work/reasons" ;;
	*) echo "$file: exit code $rc" >>"$work/bad" ;;
	esac
done <"$work/all"
echo "$loaded of $tried scenes load"
sort "$work/reasons" | uniq -c | sort -rn
[ -s "$work/bad" ] || exit 0
echo "crashed or took too long:"
cat "$work/bad"
exit 1
