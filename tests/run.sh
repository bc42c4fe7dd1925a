#!/bin/sh
# Runs all tests of a build folder and sums them up: tests/run.sh BUILD [PATTERN]
#
# Test programs are BUILD/tests/**/test_* (cmocka: each of their tests is counted); scripts are tests/lint/*.sh and
# tests/e2e/*.sh (one test each; exit 77: skipped; a line `skipped in part: WHY`: one skipped beside the one that passed). The output
# of what fails is shown. The last lines name what was skipped, as `skipped: NAME: WHY`, and sum up: `N passed, N failed, N skipped`; the
# exit code is 0 when something ran and nothing failed. PATTERN: only names that hold it.
# HSLT_TEST_KINDS: "unit script" (default both). No test has a limit of wall clock, which a busy machine would reach: it is ended when
# its processes have used HSLT_TEST_CPU seconds of processor time (default 1800; with FULL=1 28800), or have been idle without output for
# HSLT_TEST_IDLE seconds (900; 3600), see tests/limit/limit.c.
set -u
build=${1:?usage: tests/run.sh BUILD [PATTERN]}
pattern=${2:-}
kinds=${HSLT_TEST_KINDS:-unit script}
# The long forms take hours.
if [ "${FULL:-0}" = 0 ]; then
	cpu=1800 idle=900
else
	cpu=28800 idle=3600
fi
cpu=${HSLT_TEST_CPU:-$cpu} idle=${HSLT_TEST_IDLE:-$idle}
cd "$(dirname "$0")/.." || exit 1
case $build in /*) ;; *) build=$PWD/$build ;; esac
export BUILD="$build"
limit=$build/tests/limit/limit
[ -x "$limit" ] || { echo "tests/run.sh: no $limit; make tests builds it" >&2 && exit 1; }
log=$(mktemp)
trap 'rm -f "$log" "$log.counts" "$log.skips"' EXIT
passed=0 failed=0 skipped=0

count() { # of cmocka's closing lines: "[  PASSED  ] 3 test(s)."
	sed -n "s/^\[ *$1 *\] \([0-9][0-9]*\) test(s).*/\1/p" "$log" | tail -n 1
}

run_program() {
	name=${1#"$build"/tests/}
	begin=$(date +%s)
	"$limit" "$cpu" "$idle" "$1" >"$log" 2>&1
	code=$?
	ok=$(count PASSED) bad=$(count FAILED) out=$(count SKIPPED)
	passed=$((passed + ${ok:-0})) failed=$((failed + ${bad:-0})) skipped=$((skipped + ${out:-0}))
	# A crash, a limit or a leak report after the closing lines: one failure more than cmocka counted.
	if [ $code -ne 0 ] && [ "${bad:-0}" = 0 ]; then
		failed=$((failed + 1))
	fi
	if [ $code -ne 0 ]; then
		echo "FAILED $name (exit $code)"
		cat "$log"
	else
		echo "ok $name: ${ok:-0} passed, $(($(date +%s) - begin)) s"
		# What tests print about themselves (figures, reasons for skipping) is part of the result.
		grep -v '^\[' "$log" | grep -v '^$' | sed 's/^/   /'
	fi
	# By name, with what the test said before.
	awk -v of="$name" '/^\[ *RUN/ { why = "" }
		/^[^[]/ { why = $0; sub(/^skipped: /, "", why) }
		/^\[ *SKIPPED *\] [^ ]*$/ && !seen[$NF]++ { print "skipped: " of ": " $NF (why ? ": " why : "") }' "$log" >>"$log.skips"
}

run_script() {
	name=${1#tests/}
	begin=$(date +%s)
	"$limit" "$cpu" "$idle" sh "$1" "$build" >"$log" 2>&1
	code=$?
	case $code in
	0)
		passed=$((passed + 1))
		echo "ok $name, $(($(date +%s) - begin)) s"
		skipped=$((skipped + $(grep -c '^skipped in part: ' "$log")))
		sed -n "s|^skipped in part: |skipped: $name: |p" "$log" | tee -a "$log.skips"
		;;
	77)
		skipped=$((skipped + 1))
		tail -n 1 "$log" | sed "s|^skipped: ||; s|^|skipped: $name: |" | tee -a "$log.skips"
		;;
	*)
		failed=$((failed + 1))
		echo "FAILED $name (exit $code)"
		cat "$log"
		;;
	esac
}

# Runs all of a kind; the last line has the counts.
lane() {
	case $1 in
	unit)
		for t in $(find "$build/tests" -type f -name 'test_*' -perm -u+x 2>/dev/null | sort); do
			case $t in *"$pattern"*) run_program "$t" ;; esac
		done
		;;
	script)
		for t in tests/lint/*.sh tests/e2e/*.sh; do
			[ -f "$t" ] && [ "${t##*/}" != lib.sh ] || continue
			case $t in *"$pattern"*) run_script "$t" ;; esac
		done
		;;
	esac
	echo "$passed $failed $skipped" >"$log.counts"
	touch "$log.skips"
}

# Scripts mostly wait: they do so beside the programs, and are shown behind them.
beside=
case " $kinds " in
*" unit "*" script "*)
	beside=$(mktemp)
	(
		log=$beside
		lane script
	) >"$beside.out" 2>&1 &
	trap 'kill $! 2>/dev/null; rm -f "$log" "$log.counts" "$log.skips" "$beside" "$beside.out" "$beside.counts" "$beside.skips"' EXIT
	lane unit
	wait $!
	cat "$beside.out"
	;;
*) for kind in $kinds; do lane "$kind"; done ;;
esac
if [ -n "$beside" ]; then
	read -r p f s <"$beside.counts" || { echo "FAILED: the scripts did not end as they should" && f=1 p=0 s=0; }
	passed=$((passed + p)) failed=$((failed + f)) skipped=$((skipped + s))
	cat "$beside.skips" >>"$log.skips"
fi
cat "$log.skips" 2>/dev/null
echo "$passed passed, $failed failed, $skipped skipped"
[ $failed -eq 0 ] && [ $passed -gt 0 ]
