#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Renders a film in crops, each as a job of its own, on one coordinator or several, and assembles the image.
set -eu

usage() {
	cat <<'TEXT'
Usage: deploy/crops.sh --grid CxR --size WxH -o FILE.exr [OPTION...] SCENE.xml [OPTION of hslt-submit...]
Cuts a film of W x H pixels into C columns and R rows, submits each crop as a job, waits for all, and assembles them. Each job has its
own chains, groups and error, and a lease sends only the tiles of its crop: a film, or a farm, that is too large for one coordinator
can be divided among several, each with workers of its own.

  -g, --grid CxR               columns and rows
  -s, --size WxH               the whole film
  -o, --output FILE.exr        the image; crops are kept in FILE.exr.crops until it is written
  -c, --coordinators A,B,...   HOST:PORT of each coordinator; they take turns (or $HSLT_COORDINATORS, $HSLT_COORDINATOR)
  -p, --path FOLDER            where hslt-submit and hslt-assemble are (the build beside this script, else $PATH)
  -h, --help

Example:
  deploy/crops.sh -g 5x5 -s 3840x2160 -c rack1:7700,rack2:7700 -o room.exr room.xml --target-error 2% --tls ~/.hslt-ca/ann

After an interruption, call it again with the same options: finished crops are not rendered again. Jobs that were running continue, but
their crops are submitted again: cancel them with hslt-job. Exit codes are those of hslt-submit --wait (0 done, 4 done, but a bound
came before the target error in some crop, 5 done, but chains of some crop disagree, 2 usage), or 1 if a crop failed, with the message
of its hslt-submit.
TEXT
}

die() {
	echo "crops.sh: $*" >&2
	exit 2
}

# pair NAME TEXT: prints the two positive numbers in a text such as 5x5
pair() {
	case $2 in
	*[!0-9x]* | x* | *x | *x*x* | 0* | *x0*) die "$1 takes two positive numbers, as in 5x5, not '$2'" ;;
	*x*) echo "${2%x*} ${2#*x}" ;;
	*) die "$1 takes two positive numbers, as in 5x5, not '$2'" ;;
	esac
}

grid= size= output= coordinators=${HSLT_COORDINATORS:-${HSLT_COORDINATOR:-}} path=
while [ $# -gt 0 ]; do
	case $1 in
	-g | --grid | -s | --size | -o | --output | -c | --coordinators | -p | --path)
		[ $# -ge 2 ] || die "$1 needs a value"
		case $1 in
		-g | --grid) grid=$2 ;;
		-s | --size) size=$2 ;;
		-o | --output) output=$2 ;;
		-c | --coordinators) coordinators=$2 ;;
		-p | --path) path=$2 ;;
		esac
		shift 2
		;;
	-h | --help) usage && exit 0 ;;
	-*) die "unknown option $1 before the scene (see --help)" ;;
	*) break ;;
	esac
done
[ $# -ge 1 ] && [ -n "$grid" ] && [ -n "$size" ] && [ -n "$output" ] || die "--grid, --size, -o and a scene are needed (see --help)"
[ -n "$coordinators" ] || die "no coordinator: --coordinators A,B or HSLT_COORDINATORS"
cells=$(pair --grid "$grid") && film=$(pair --size "$size") || exit 2
columns=${cells% *} rows=${cells#* } width=${film% *} height=${film#* }
[ $((columns * rows)) -le 1024 ] && [ "$columns" -le "$width" ] && [ "$rows" -le "$height" ] || die "--grid $grid for --size $size: at most 1024 crops, each of at least one pixel"
if [ -z "$path" ]; then
	path=$(dirname "$0")/../build/bin
	[ -x "$path/hslt-assemble" ] || path=
fi
program() {
	echo "${path:+$path/}$1"
}

crops=$output.crops
mkdir -p "$crops"
pids=
trap 'trap - TERM; kill $pids 2>/dev/null || :; wait; exit 130' INT TERM

# Crops must not be mixed with those of a call with another scene, grid, size or options.
printf '%s\n' "$grid" "$size" "$@" >"$crops/call.new"
if [ -f "$crops/call" ] && ! cmp -s "$crops/call" "$crops/call.new"; then
	rm "$crops/call.new"
	die "$crops holds crops of another scene, grid, size or other options: remove it, or name another output"
fi
mv "$crops/call.new" "$crops/call"

# turn N: prints the coordinator of the N-th crop: they take turns
turn() {
	echo "$coordinators" | awk -F, -v n="$1" '{ print $(n % NF + 1) }'
}

# crop FILE OPTION...: renders FILE.exr; FILE.id, FILE.log and FILE.code are the job's id, hslt-submit's messages and exit code
crop() {
	file=$1 code=0
	shift
	trap 'kill ${!:-} 2>/dev/null || :; wait; exit 130' TERM
	"$(program hslt-submit)" "$@" -o "$file.exr" --wait >"$file.id" 2>"$file.log" &
	wait $! || code=$?
	echo $code >"$file.code"
	return $code
}

n=0 row=0 files=
while [ $row -lt "$rows" ]; do
	column=0
	y=$((height * row / rows)) h=$((height * (row + 1) / rows - height * row / rows))
	while [ $column -lt "$columns" ]; do
		x=$((width * column / columns)) w=$((width * (column + 1) / columns - width * column / columns))
		file=$crops/$column-$row
		if [ ! -f "$file.exr" ]; then
			rm -f "$file.id" "$file.code"
			crop "$file" --coordinator "$(turn $n)" "$@" --size "$size" --crop "$x,$y,$w,$h" &
			pids="$pids $!"
			files="$files $column-$row"
			# Each hslt-submit builds the scene before it submits: let only one at a time do that.
			until [ -s "$file.id" ] || ! kill -0 $! 2>/dev/null; do
				sleep 0.05
			done
		fi
		n=$((n + 1)) column=$((column + 1))
	done
	row=$((row + 1))
done
echo "crops.sh: $n crops, $(echo $pids | wc -w) of them to render" >&2

failed=0 done=0 left=$pids
for file in $files; do
	pid=${left# } && pid=${pid%% *} && left=${left# } && left=${left#"$pid"}
	code=0
	wait "$pid" || code=$?
	done=$((done + 1))
	if [ -f "$crops/$file.exr" ]; then
		echo "crops.sh: $file is done ($done)" >&2
	else
		failed=$((failed + 1))
		echo "crops.sh: $file failed ($code): $(tail -n 1 "$crops/$file.log")" >&2
	fi
done
[ $failed -eq 0 ] || exit 1
code=0
"$(program hslt-assemble)" "$crops"/*.exr -o "$output" || code=$?
if [ $code -eq 0 ] && cat "$crops"/*.code 2>/dev/null | grep -qx 4; then
	code=4
fi
case $code in 0 | 4 | 5) rm -rf "$crops" ;; esac
exit $code
