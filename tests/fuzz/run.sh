# SPDX-License-Identifier: Apache-2.0
# Fuzzers: builds every tests/fuzz/fuzz_*.c with clang and runs each for FUZZ_SECONDS (60), one per processor at a time.
#
#     sh tests/fuzz/run.sh                      FUZZ_TARGETS="frame tile": only these
#     sh tests/fuzz/run.sh --build GOAL...      builds these goals of the Makefile as the fuzzers are built, and runs nothing
#
# Seeds: those that a target makes from the present messages, tests/fuzz/corpus/NAME, and the small files of tests/scenes.
# Nothing is written into the tree: findings go to BUILD/findings and make the exit code 1; a growing corpus is kept in
# BUILD/corpus. A finding is a crash, an input that takes 10 s, an allocation of 512 MB, or 2 GB in all. Runs of less than
# a minute are meant for daily use on any machine: they always begin with the same random number, and an input may take a
# minute.
set -u
cd "$(dirname "$0")/../.." || exit 1
BUILD=${BUILD:-build/fuzz}
CLANG=${CLANG:-clang}
SECONDS_EACH=${FUZZ_SECONDS:-60}
[ "$SECONDS_EACH" -lt 60 ] && seed=1 slow=60 || seed=0 slow=10

jobs=$(nproc 2>/dev/null || echo 1)
mkdir -p "$BUILD"

# figure NAME LOG: prints the last value of libFuzzer's progress lines
figure() {
	sed -n "s/.* $1: \([0-9]*\).*/\1/p" "$2" | tail -n 1
}

# one SOURCE: runs a target for its time, and reports its findings
one() {
	name=$(basename "$1" .c)
	corpus=$BUILD/corpus/$name log=$BUILD/$name.log
	mkdir -p "$corpus"
	case $name in fuzz_image | fuzz_scene) find tests/scenes -type f -size -64k -exec cp {} "$corpus" \; ;; esac
	[ -d "tests/fuzz/corpus/$name" ] && cp tests/fuzz/corpus/"$name"/* "$corpus"
	! grep -q seeds_wanted "$1" || HSLT_FUZZ_SEEDS=$corpus "$BUILD/fuzz/$name" || return 1
	words=
	[ ! -f "tests/fuzz/$name.dict" ] || words=-dict=tests/fuzz/$name.dict
	if "$BUILD/fuzz/$name" $words -max_total_time="$SECONDS_EACH" -rss_limit_mb=2048 -malloc_limit_mb=512 -timeout=$slow -seed=$seed -max_len=16384 -close_fd_mask=2 \
		-print_final_stats=1 -artifact_prefix="$BUILD/findings/$name-" "$corpus" >"$log" 2>&1; then
		echo "fuzz: $name: $(sed -n 's/^stat::number_of_executed_units: *//p' "$log") inputs in $SECONDS_EACH s," \
			"$(figure cov "$log") edges, nothing found"
	else
		grep -E 'ERROR|SUMMARY|runtime error|Test unit written' "$log"
		echo "fuzz: $name: FOUND something; all of it is in $log"
		return 1
	fi
}

if [ "${1:-}" = --one ]; then
	one "$2"
	exit
fi

for target in ${FUZZ_TARGETS:-}; do
	[ -f "tests/fuzz/fuzz_$target.c" ] && continue
	echo "fuzz: there is no target $target; there are" tests/fuzz/fuzz_*.c | sed 's|tests/fuzz/fuzz_||g; s|\.c||g'
	exit 2
done
if ! command -v "$CLANG" >/dev/null 2>&1; then
	echo "fuzz: skipped: $CLANG is not installed (apt install clang)"
	exit 77
fi
run=1 goals=fuzzers
if [ "${1:-}" = --build ]; then
	shift
	run=0 goals=$*
fi
"${MAKE:-make}" --no-print-directory -j"$jobs" CC="$CLANG" BUILD="$BUILD" SAN=fuzzer-no-link,address,undefined $goals >"$BUILD.log" 2>&1 || {
	tail -20 "$BUILD.log"
	echo "fuzz: the build failed; all of it is in $BUILD.log"
	exit 1
}
[ $run = 1 ] || exit 0

mkdir -p "$BUILD/findings"
for source in tests/fuzz/fuzz_*.c; do
	name=$(basename "$source" .c)
	case " ${FUZZ_TARGETS:-${name#fuzz_}} " in *" ${name#fuzz_} "*) echo "$source" ;; esac
done | xargs -r -n 1 -P "$jobs" sh tests/fuzz/run.sh --one || exit 1
