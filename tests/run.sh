#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Runs all tests of a build folder and sums them up: tests/run.sh BUILD [PATTERN]
#
# Test programs are BUILD/tests/**/test_* (cmocka: each of their tests is counted); scripts are tests/lint/*.sh and tests/e2e/*.sh. A
# script counts as one test; exit code 77 means skipped, and a line `skipped in part: WHY` counts as one skipped test besides the one that
# passed. The output of failed tests is shown. That of passed tests, such as figures, is kept in BUILD/tests/said (and shown with
# HSLT_TEST_VERBOSE=1). The last lines name the failed tests, as `failed: NAME: WHY`, and the skipped ones, as `skipped: NAME: WHY`, and
# sum up: `N passed, N failed, N skipped`. The exit code is 0 if something passed and nothing failed. PATTERN: run only tests whose path
# contains it.
#
# As many programs run at a time as there are processors (HSLT_TEST_JOBS), the longest of the last run first. Scripts and the programs
# that test connections spend most of their time waiting: three scripts and two such programs run beside the others, which are niced.
# HSLT_TEST_KINDS: "unit", "script" or both (default). HSLT_TEST_WITHOUT: an extended regular expression; matching tests are left out.
# No test has a wall-clock limit, which it could exceed on a busy machine. Instead it is ended when its processes have used HSLT_TEST_CPU
# seconds of CPU time (default 1800; 28800 with FULL=1), or have been idle without output for HSLT_TEST_IDLE seconds (900; 3600), see
# tests/limit/limit.c. SIGINT, SIGTERM and SIGHUP end the running tests and the run.
set -u
if [ "${1:-}" = --one ]; then # runs one test of the run in folder $2: its kind $3, its file $4
	run=$2 kind=$3 file=$4
	[ ! -e "$run/ended" ] || exit 0 # the run was ended by a signal
	. "$run/settings"
	log=$(mktemp -p "$run")
	begin=$(date +%s)
	case $kind in
	script) name=${file#tests/} && set -- sh "$file" "$BUILD" ;;
	*) name=${file#"$BUILD"/tests/} && set -- "$file" ;;
	esac
	"$limit" "$cpu" "$idle" "$@" >"$log" 2>&1 &
	echo $! >"$log.limit"
	wait $!
	code=$?
	rm "$log.limit"
	took=$(($(date +%s) - begin))
	echo "$took $file" >"$log.took"
	times >"$log.times"
	used=$(awk 'NR == 2 { gsub("s", ""); split($1, u, "m"); split($2, s, "m"); print int(60 * (u[1] + s[1]) + u[2] + s[2] + 0.5) }' "$log.times")

	count() { # the number in a closing line of cmocka: "[  PASSED  ] 3 test(s)." or, in later versions, "[  SKIPPED ] tests: 1 test(s), listed below:"
		sed -n "s/^\[ *$1 *\] \([^ ]*: \)*\([0-9][0-9]*\) test(s).*/\2/p" "$log" | tail -n 1
	}
	if [ "$kind" != script ]; then
		ok=$(count PASSED) bad=$(count FAILED) out=$(count SKIPPED)
		# The names of skipped tests, each with the last line that the test printed.
		awk -v of="$name" '/^\[ *RUN/ { why = "" }
			/^[^[]/ { why = $0; sub(/^skipped: /, "", why) }
			/^\[ *SKIPPED *\] [^ ]*$/ && !seen[$NF]++ { print "skipped: " of ": " $NF (why ? ": " why : "") }' "$log" >"$log.skips"
	elif [ $code -eq 77 ]; then
		ok=0 bad=0 out=1
		tail -n 1 "$log" | sed "s|^skipped: ||; s|^|skipped: $name: |" >"$log.skips"
	else
		ok=$((code == 0)) bad=0 out=0
		if [ $code -eq 0 ]; then
			sed -n "s|^skipped in part: |skipped: $name: |p" "$log" >"$log.skips"
			out=$(grep -c . "$log.skips")
		fi
	fi
	{
		if [ $code -ne 0 ] && [ $code -ne 77 ]; then
			# A crash, a limit or a leak report after the closing lines is a failure that cmocka has not counted.
			[ "${bad:-0}" != 0 ] || bad=1
			echo "FAILED $name (exit $code)"
			cat "$log"
		else
			echo "ok $name: ${ok:-0} passed, $took s, $used s of CPU time"
		fi
	} >"$log.shown"
	# The output of a test (figures, reasons for skipping) is kept, and shown on request.
	if [ -s "$log" ]; then
		mkdir -p "$said/$(dirname "$name")"
		grep -v '^\[\|^$' "$log" >"$said/$name.txt"
		[ "${HSLT_TEST_VERBOSE:-0}" = 0 ] || [ $code -ne 0 ] || sed 's/^/   /' "$said/$name.txt" >>"$log.shown"
	fi
	# The reason is the message of a script's `fail`, or the names of a program's failed tests; otherwise the last line of output.
	if [ "${bad:-0}" != 0 ]; then
		why=$(if [ "$kind" != script ]; then
			sed -n 's/^\[ *FAILED *\] \([^ ]*\)$/\1/p' "$log" | sort -u | paste -sd ' ' -
		else
			sed -n 's/^FAILED: //p' "$log" | head -n 1
		fi)
		[ -n "$why" ] || why=$(grep . "$log" | tail -n 1)
		echo "$name${why:+: $(echo "$why" | cut -c1-300)}" >"$log.bad"
	fi
	echo "${ok:-0} ${bad:-0} ${out:-0}" >"$log.counts"
	# The lock keeps the output of tests that end at the same time apart.
	flock "$run/settings" cat "$log.shown"
	exit 0
fi

build=${1:?usage: tests/run.sh BUILD [PATTERN]}
for number in HSLT_TEST_JOBS HSLT_TEST_CPU HSLT_TEST_IDLE; do
	eval "given=\${$number:-1}"
	case $given in
	*[!0-9]* | 0*) echo "tests/run.sh: $number is a whole number above 0, not '$given'" >&2 && exit 2 ;;
	esac
done
pattern=${2:-}
kinds=${HSLT_TEST_KINDS:-unit script}
# The long forms of tests (FULL=1) take hours.
if [ "${FULL:-0}" = 0 ]; then
	cpu=1800 idle=900
else
	cpu=28800 idle=3600
fi
cd "$(dirname "$0")/.." || exit 1
case $build in /*) ;; *) build=$PWD/$build ;; esac
export BUILD="$build"
limit=$build/tests/limit/limit
[ -x "$limit" ] || { echo "tests/run.sh: no $limit; make tests builds it" >&2 && exit 1; }
run=$(mktemp -d)
trap 'rm -rf "$run"' EXIT
cat >"$run/settings" <<END
cpu=${HSLT_TEST_CPU:-$cpu} idle=${HSLT_TEST_IDLE:-$idle} limit='$limit' said='$build/tests/said'
END
took=$build/tests/took # seconds and file of each test in the last run
touch "$took"
# The order of a first run: tests that take minutes begin first.
longest="worker/render/path/test_integrators worker/render/mutation/test_balance worker/render/mutation/test_forced image/test_calibration worker/render/path/test_motion image/test_reference worker/render/path/test_volume_emission numerics/test_random worker/render/mutation/test_tolerance image/test_effects numerics/test_agree coordinator/status/test_status coordinator/peers/test_orders"
longest="$longest e2e/faults.sh e2e/slurm.sh e2e/tls.sh e2e/orders.sh e2e/accuracy.sh e2e/disagree.sh e2e/estimate.sh e2e/restart.sh e2e/runner.sh e2e/small_disk.sh e2e/full_later.sh e2e/full.sh"

# Prints the tests of a list, one per line: new ones first, then those that took longest the last time.
list() {
	waits='/tests/(common/net|coordinator/(jobs|peers|server|status)|worker/daemon)/'
	case $1 in
	unit) find "$build/tests" -type f -name 'test_*' -perm -u+x | grep -vE "$waits" | sort ;;
	wait) find "$build/tests" -type f -name 'test_*' -perm -u+x | grep -E "$waits" | sort ;;
	script) ls tests/lint/*.sh tests/e2e/*.sh | grep -v '/lib\.sh$' ;;
	esac | grep -F -e "$pattern" | if [ -n "${HSLT_TEST_WITHOUT:-}" ]; then grep -vE -e "$HSLT_TEST_WITHOUT"; else cat; fi |
		awk -v took="$took" -v longest="$longest" 'BEGIN {
				n = split(longest, names, " ")
				for (i = 1; i <= n; i++)
					first[names[i]] = n + 1 - i
				while ((getline line <took) > 0) {
					split(line, f, " ")
					s[f[2]] = f[1]
				}
			}
			{ name = $0; sub(/.*\/tests\/|^tests\//, "", name); print ($0 in s ? s[$0] : 1000000 + first[name]), NR, $0 }' | sort -k1,1nr -k2,2n | cut -d' ' -f3
}
one() { # one LIST TESTS_AT_A_TIME NICENESS: runs the tests of a list
	nice -n "$3" xargs -r <"$run/$1.list" -n 1 -P "$2" --process-slot-var=HSLT_TEST_SLOT sh tests/run.sh --one "$run" "$1"
}

for kind in unit script; do
	case " $kinds " in *" $kind "*) list $kind ;; esac >"$run/$kind.list"
done
case " $kinds " in *" unit "*) list wait ;; esac >"$run/wait.list"
jobs=${HSLT_TEST_JOBS:-$(nproc 2>/dev/null || echo 2)}
{
	one script $((jobs > 1 ? 3 : 1)) 0 &
	one wait $((jobs > 1 ? 2 : 1)) 0 &
	one unit "$jobs" 5 &
	wait
} &
lists=$!
# Ends the running tests, repeatedly, to catch those that were just beginning; no further tests begin.
end() {
	trap '' INT TERM HUP
	: >"$run/ended"
	while :; do cat "$run"/*.limit | xargs -r kill; sleep 0.5; done 2>/dev/null &
	wait $lists
	kill -9 $!
	echo "tests/run.sh: ended by a signal" >&2
	exit 130
}
trap end INT TERM HUP
wait $lists
cat "$run"/*.took "$took" 2>/dev/null | awk '!seen[$2]++' >"$took.new" && mv "$took.new" "$took"
cat "$run"/*.bad 2>/dev/null | sort | sed 's/^/failed: /'
cat "$run"/*.skips 2>/dev/null | sort
# A test without counts was ended from outside, which is a failure.
lost=$(($(cat "$run"/*.list | wc -l) - $(ls "$run" | grep -c '\.counts$')))
[ "$lost" = 0 ] || echo "FAILED: $lost tests did not end as they should"
{ echo "0 $lost 0" && cat "$run"/*.counts 2>/dev/null; } | awk '{ p += $1; f += $2; s += $3 }
	END { print p + 0 " passed, " f + 0 " failed, " s + 0 " skipped"; exit !(f == 0 && p > 0) }'
