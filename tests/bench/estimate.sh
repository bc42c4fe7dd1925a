#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Does hslt-render --estimate hold what it promises? In each row a pilot with one seed predicts the cost of a target,
# and a render with another seed goes there. Required: in 80 % of the rows the processor time lies in the predicted 90 %
# interval, and the median of predicted over real is within a factor 1.25. The same is shown in mutations, which do not
# depend on other processes of the machine.
#
#    sh tests/bench/estimate.sh [BUILD [ROWS]]      ROWS: a pattern of scenes, such as 'demo|box' (all)
#
# HSLT_SCENES names a folder of public scenes; without it those rows are left out. PILOT: seconds of a pilot (15).
# THREADS (1). About an hour on one core.
set -eu
BUILD=${1:-build}
ROWS=${2:-.}
BIN=$BUILD/bin
HERE=$(dirname "$0")
PILOT=${PILOT:-15}
THREADS=${THREADS:-1}
DIR=$(mktemp -d "${TMPDIR:-/tmp}/hslt-estimate.XXXXXX")
trap 'rm -rf "$DIR"' EXIT
trap 'exit 130' INT TERM

# range FILE TARGET KEY: prints low, expected and high of the target's row
range() {
	awk -v target="$2" -v key="\"$3\":{" '{
		n = split($0, row, "{\"error\":")
		for (i = 2; i <= n; i++)
			if ((row[i] + 0) / target > 0.999999 && (row[i] + 0) / target < 1.000001) {
				s = substr(row[i], index(row[i], key) + length(key))
				split(s, x, /[:,}]/)
				print x[2], x[4], x[6]
			}
	}' "$1"
}

# number FILE KEY: prints that number
number() {
	grep -o '"'"$2"'": *[-0-9.e+]*' "$1" | head -n 1 | sed 's/.*: *//'
}

# row NAME SCENE TARGET SEED EPOCH [OPTION...]: measures and prints one row
row() {
	name=$1 scene=$2 target=$3 seed=$4 epoch=$5
	shift 5
	echo "$name" | grep -Eq "$ROWS" || return 0
	[ -e "$scene" ] || return 0
	set -- "$scene" --quiet --threads "$THREADS" --size 160x90 --epoch "$epoch" --target-error "$target" "$@"
	"$BIN/hslt-render" --estimate --pilot "$PILOT" --json --seed $((seed + 1000)) "$@" >"$DIR/pilot.json"
	"$BIN/hslt-render" -o "$DIR/a.exr" --stats "$DIR/stats.json" --seed "$seed" "$@" || code=$?
	[ "${code:-0}" -eq 0 ] || [ "$code" -eq 5 ]
	mutations=$(number "$DIR/stats.json" samples)
	cpu=$(number "$DIR/stats.json" cpuSeconds)
	pilot=$(number "$DIR/pilot.json" cpuSeconds)
	echo "$name $target $pilot $cpu $mutations $(range "$DIR/pilot.json" "$target" cpuSeconds) $(range "$DIR/pilot.json" "$target" mutations)" |
		tee -a "$DIR/rows" | awk '{
			printf "%-14s %5.3g %%  pilot %5.0f s  predicted %6.0f s (%5.0f - %5.0f)  real %6.0f s  %-4s %5.2f   in mutations %-4s %5.2f\n",
				$1, 100 * $2, $3, $7, $6, $8, $4, $6 <= $4 && $4 <= $8 ? "in" : "OUT", $7 / $4,
				$9 <= $5 && $5 <= $11 ? "in" : "OUT", $10 / $5 }'
}

scenes=$HERE/../scenes
public=${HSLT_SCENES:-/nowhere}
row demo "$scenes/demo/scene.xml" 0.12 1 128
row demo "$scenes/demo/scene.xml" 0.10 2 128
row demo "$scenes/demo/scene.xml" 0.08 3 128
row demo-path "$scenes/demo/scene.xml" 0.12 4 1 --integrator path
row box "$scenes/box/box.xml" 0.05 1 128
row box "$scenes/box/box.xml" 0.035 2 128
row box "$scenes/box/box.xml" 0.03 3 128
row box-pssmlt "$scenes/box/box.xml" 0.08 4 128 --integrator pssmlt
row displaced "$scenes/displaced/scene.xml" 0.12 1 64
row displaced "$scenes/displaced/scene.xml" 0.09 2 64
row displaced "$scenes/displaced/scene.xml" 0.07 3 64
row cornell-box "$public/cornell-box/scene.xml" 0.07 1 64
row cornell-box "$public/cornell-box/scene.xml" 0.055 2 64
row cornell-box "$public/cornell-box/scene.xml" 0.045 3 64
row veach-door "$public/veach-door/scene.xml" 0.40 1 32
row veach-door "$public/veach-door/scene.xml" 0.32 2 32
row veach-door "$public/veach-door/scene.xml" 0.27 3 32
row three-spheres "$public/three-spheres.xml" 0.13 1 128
row three-spheres "$public/three-spheres.xml" 0.10 2 128
row three-spheres "$public/three-spheres.xml" 0.085 3 128

# over the rows: how many intervals hold, and the median of predicted over real
awk '
	function median(x, n,   i, j, t) {
		for (i = 2; i <= n; i++)
			for (j = i; j > 1 && x[j] < x[j - 1]; j--) {
				t = x[j]; x[j] = x[j - 1]; x[j - 1] = t
			}
		return n % 2 ? x[(n + 1) / 2] : sqrt(x[n / 2] * x[n / 2 + 1])
	}
	{
		n++
		cpu += $6 <= $4 && $4 <= $8
		work += $9 <= $5 && $5 <= $11
		a[n] = $7 / $4
		b[n] = $10 / $5
	}
	END {
		printf "%d rows; processor time: %d within, median of predicted over real %.2f; mutations: %d within, median %.2f\n",
			n, cpu, median(a, n), work, median(b, n)
		exit !(cpu >= 0.8 * n && median(a, n) < 1.25 && median(a, n) > 0.8)
	}' "$DIR/rows"
