#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Checks that two builds render the same bits: sh tests/numerics/compilers.sh BUILD OTHER
#
# OTHER is built by another compiler, or with other options. Arithmetic is strict IEEE, so only an order of evaluation
# that C leaves open, an uninitialised value or a contracted operation can make a difference.
set -eu
build=$1 other=$2
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
render() { # BUILD IMAGE
	"$1/bin/hslt-render" "tests/scenes/$scene.xml" -o "$2" --size 32 --spp 4 --integrator "$integrator" --quiet 2>"$dir/err" ||
		{ cat "$dir/err" && exit 1; }
}

for scene in demo/scene displaced/water numbers/glass; do
	for integrator in path bdpt erpt hslt pssmlt; do
		render "$build" "$dir/one.exr"
		render "$other" "$dir/other.exr"
		"$build/bin/hslt-compare" --exact "$dir/one.exr" "$dir/other.exr" >"$dir/out" || {
			echo "$scene by $integrator: $build and $other differ: $(cat "$dir/out")" && exit 1
		}
	done
done
