#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Runs the numerically hard cases, one row each: topic, case, measured value, bound, verdict. tests/numerics/run.sh
# BUILD; FULL=1: the long forms. Exit code 0: no case failed.
set -u
build=${1:?usage: tests/numerics/run.sh BUILD}
cd "$(dirname "$0")/../.." || exit 1
case $build in /*) ;; *) build=$PWD/$build ;; esac
export BUILD="$build" HSLT_TEST_ROWS=1
log=$(mktemp)
rows=$(mktemp)
trap 'rm -f "$log" "$rows"' EXIT
passed=0 failed=0
tab=$(printf '\t')

# A program that fails without a failed row gets a row itself.
for t in "$build"/tests/worker/render/halfvec/test_* "$build"/tests/numerics/test_* \
	"$build"/tests/worker/render/test_number_ranges "$build"/tests/worker/render/test_scene_numbers; do
	[ -x "$t" ] && [ -f "$t" ] || continue
	"$t" >"$log" 2>&1
	code=$?
	name=${t#"$build"/tests/}
	grep "${tab}ok\$\|${tab}FAILED\$" "$log" >"$rows"
	if [ $code -eq 0 ] && [ ! -s "$rows" ]; then
		printf '%s\t%s\t%s\t%s\n' "$name" "all of it" "$(grep -v '^\[' "$log" | grep . | tail -n 1)" ok >"$rows"
	elif [ $code -ne 0 ] && ! grep -q "${tab}FAILED\$" "$rows"; then
		printf '%s\t%s\t%s\t%s\n' "$name" "exit code $code" "$(grep -m 1 'ERROR' "$log")" FAILED >>"$rows"
	fi
	awk -F "$tab" '{
		verdict = $NF; bound = NF > 4 ? "; must be: " $4 : "";
		if (NF > 4 && $3 ~ /^[0-9.e+-]+$/) { $3 = "error " $3; bound = ", at most " $4 }
		printf "%-6s %-22s %-34s %s%s\n", verdict, $1, $2, $3, bound }' "$rows"
	# Everything else that the program printed.
	grep -v '^\[' "$log" | grep -v "${tab}ok\$\|${tab}FAILED\$" | grep . | sed 's/^/       /'
	passed=$((passed + $(grep -c "${tab}ok\$" "$rows")))
	failed=$((failed + $(grep -c "${tab}FAILED\$" "$rows")))
done
echo "$passed cases passed, $failed failed"
[ $failed -eq 0 ] && [ $passed -gt 0 ]
