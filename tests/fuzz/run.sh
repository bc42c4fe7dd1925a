# Builds every tests/fuzz/fuzz_*.c with clang and runs each for FUZZ_SECONDS (60). Seeds: tests/fuzz/corpus/NAME and the small
# files of tests/scenes. What is found stays in BUILD/findings and ends the run with 1; a corpus that grows is BUILD/corpus.
set -u
cd "$(dirname "$0")/../.." || exit 1
BUILD=${BUILD:-build/fuzz}
CLANG=${CLANG:-clang}
SECONDS_EACH=${FUZZ_SECONDS:-60}

mkdir -p "$BUILD"

if ! command -v "$CLANG" >/dev/null 2>&1; then
	echo "fuzz: skipped: $CLANG is not installed (apt install clang)"
	exit 0
fi
"${MAKE:-make}" --no-print-directory CC="$CLANG" BUILD="$BUILD" SAN=fuzzer-no-link,address,undefined OPT=-O1 fuzzers >"$BUILD.log" 2>&1 || {
	tail -20 "$BUILD.log"
	echo "fuzz: the build failed; all of it is in $BUILD.log"
	exit 1
}

failed=0
for source in tests/fuzz/fuzz_*.c; do
	name=$(basename "$source" .c)
	mkdir -p "$BUILD/corpus/$name" "$BUILD/findings"
	find tests/scenes -type f -size -64k -exec cp {} "$BUILD/corpus/$name" \;
	[ -d "tests/fuzz/corpus/$name" ] && cp tests/fuzz/corpus/"$name"/* "$BUILD/corpus/$name"
	if "$BUILD/fuzz/$name" -max_total_time="$SECONDS_EACH" -rss_limit_mb=2500 -timeout=10 -print_final_stats=1 \
		-artifact_prefix="$BUILD/findings/$name-" "$BUILD/corpus/$name" >"$BUILD/$name.log" 2>&1; then
		echo "fuzz: $name: $(sed -n 's/^stat::number_of_executed_units: *//p' "$BUILD/$name.log") inputs in $SECONDS_EACH s, nothing found"
	else
		failed=1
		grep -E 'ERROR|SUMMARY|runtime error|Test unit written' "$BUILD/$name.log"
		echo "fuzz: $name: FOUND something; all of it is in $BUILD/$name.log"
	fi
done
exit $failed
