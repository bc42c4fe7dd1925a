#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Installs missing packages, builds, and runs the tests: one of the two commands of the README.
#
#   sh deploy/test.sh          all tests for which the build packages suffice; lists the skipped ones
#   sh deploy/test.sh --full   also those that need large packages: a build with clang, fuzzers, longer statistical runs
#   sh deploy/test.sh --ci     all kinds of tests at short lengths; stops after the first kind in which a test failed
#
# HSLT_SCENES names a folder of public scenes; without it the tests that need them are skipped. The last line is
# `N passed, N failed, N skipped`; the lines before it say what was skipped, with reasons, and what failed. The exit code is
# 0 if nothing failed. With --full and --ci a missing package is a failure, not a reason to skip.
set -eu
cd "$(dirname "$0")/.."
mode=plain
case "${1:-}" in
"") ;;
--full) mode=full ;;
--ci) mode=ci ;;
-h | --help)
	sed -n '3,/^set /s/^# \{0,1\}//p' "$0"
	exit 0
	;;
*)
	echo "test.sh: unknown option '$1' (try --help)" >&2
	exit 2
	;;
esac

begin=$(date +%s)
jobs=$(nproc 2>/dev/null || echo 2)
results=$(mktemp)
skips=$(mktemp)
fails=$(mktemp)
trap 'rm -f "$results" "$results.code" "$skips" "$fails"' EXIT
passed=0 failed=0 skipped=0

# kind TITLE COMMAND...: runs one kind of tests and shows its output, but adds its last line to the sums instead of printing it.
kind() {
	title=$1
	shift
	echo "== $title"
	code=0
	{ "$@" 2>&1 || echo "exit $?" >"$results.code"; } | tee "$results" | grep --line-buffered -v '^[0-9]* passed, [0-9]* failed, [0-9]* skipped$\|^skipped: \|^failed: ' || true
	sed -n "s|^failed: |failed: $title: |p" "$results" >>"$fails"
	grep '^skipped: ' "$results" | sort -u | sed "s|^skipped: |skipped: $title: |" >>"$skips" || true
	[ ! -f "$results.code" ] || { code=1 && rm -f "$results.code"; }
	line=$(grep '^[0-9]* passed, [0-9]* failed, [0-9]* skipped$' "$results" | tail -n 1)
	set -- $(echo "$line" | tr -dc '0-9 ')
	passed=$((passed + ${1:-0})) skipped=$((skipped + ${3:-0}))
	bad=${2:-0}
	# A kind that fails without counting a failure (because it did not build, or crashed) counts as one failure.
	[ $code -eq 0 ] || [ "$bad" -gt 0 ] || bad=1
	failed=$((failed + bad))
	[ $code -eq 0 ] || echo "== FAILED: $title"
	ended
}

# Ends a kind or step. With --ci the run stops at the first one that failed: the others would take as long again and bury its
# output.
ended() {
	echo "== $(($(date +%s) - begin)) s since the beginning"
	[ $mode != ci ] || [ $failed -eq 0 ] || sum_up
}

# Prints the last lines and exits.
sum_up() {
	cat "$skips" "$fails"
	echo "$passed passed, $failed failed, $skipped skipped"
	exit $((failed > 0))
}

# step TITLE COMMAND...: runs a command that passes or fails as a whole; its output is shown only if it fails.
step() {
	title=$1
	shift
	echo "== $title"
	if "$@" >"$results" 2>&1; then
		passed=$((passed + 1))
		skipped=$((skipped + $(grep -c '^skipped in part: ' "$results" || true)))
		sed -n "s|^skipped in part: |skipped: $title: |p" "$results" >>"$skips"
	else
		failed=$((failed + 1))
		cat "$results"
		echo "== FAILED: $title"
		echo "failed: $title" >>"$fails"
	fi
	ended
}

skip() {
	skipped=$((skipped + 1))
	echo "skipped: $1" >>"$skips"
}

if [ $mode = plain ]; then
	sh deploy/setup.sh
else
	sh deploy/setup.sh --full
	export HSLT_TEST_ALL=1 WERROR=-Werror
fi

step "build" make -s -j"$jobs" programs tests
kind "tests" make -s test
[ -n "${HSLT_SCENES:-}" ] || echo "   (public scenes were not tested: HSLT_SCENES is not set)"

if [ $mode = plain ]; then
	skip "sanitizers: make test SAN=address,undefined, or --full"
	skip "clang, fuzzers: --full"
else
	step "build with address and undefined sanitizers" make -s -j"$jobs" SAN=address,undefined programs tests
	# With --ci, tests that compare images for minutes are left out, to stay within half an hour; others run the same code.
	without=${HSLT_TEST_WITHOUT:-}
	[ $mode != ci ] || without='path/test_(motion|volume_emission|closed_form|integrators|merging|overlong)$|test_infinite$|bsdf/test_sampling$|test_redistribution$|test_many$|render/test_count_rays$'
	kind "tests with sanitizers, 1/20 of the samples" env HSLT_TEST_KINDS=unit HSLT_TEST_WITHOUT="$without" \
		make -s SAN=address,undefined test
	step "build with clang" sh tests/fuzz/run.sh --build programs fuzzers test-syntax
	step "the same bits as by clang's build" sh tests/numerics/compilers.sh build build/fuzz
	if [ $mode = full ]; then
		kind "tests with clang's sanitizers" env HSLT_TEST_KINDS=unit make -s -j"$jobs" CC=clang BUILD=build/clang \
			SAN=address,undefined test
		kind "long forms" make -s FULL=1 test
		step "faults, each as often as the table says" sh tests/e2e/faults.sh build --all
		step "fuzzers, 10 minutes each" make -s fuzz FUZZ_SECONDS=600
	else
		step "fuzzers, 3 s each" make -s fuzz FUZZ_SECONDS=3
	fi
fi
sum_up
