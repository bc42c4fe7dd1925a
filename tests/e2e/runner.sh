# tests/run.sh counts and names what was skipped, as a whole and in part, and what failed; where everything is installed a test that
# lacks something fails.
. "$(dirname "$0")/lib.sh"
mkdir -p "$DIR/tests/e2e" "$DIR/build/tests/one"
cp "$HERE/../run.sh" "$DIR/tests/"
cp "$HERE/lib.sh" "$DIR/tests/e2e/"
script() {
	{ echo '. "$(dirname "$0")/lib.sh"' && cat; } >"$DIR/tests/e2e/$1.sh"
}
script whole <<'TEXT'
echo "on the way"
skip "it rains"
TEXT
script part <<'TEXT'
skip_part "the roof: it rains"
echo "the rest stands"
TEXT
script bare <<'TEXT'
lacks "no umbrella"
TEXT
cat >"$DIR/build/tests/one/test_one" <<'TEXT'
#!/bin/sh
echo '[ RUN      ] dry'
echo 'it is dry'
echo '[       OK ] dry'
echo '[ RUN      ] wet'
echo 'skipped: no rain'
echo '[  SKIPPED ] wet'
echo '[  PASSED  ] 1 test(s).'
echo '[  SKIPPED ] 1 test(s), listed below:'
echo '[  SKIPPED ] wet'
TEXT
chmod +x "$DIR/build/tests/one/test_one"
run() {
	CODE=0
	sh "$DIR/tests/run.sh" "$DIR/build" >"$DIR/said" 2>"$DIR/err.log" || CODE=$?
	tail -n "$1" "$DIR/said" | sort >"$DIR/last"
	sort | diff - "$DIR/last" || fail "the last lines are other ones: $(cat "$DIR/said")"
}
unset HSLT_TEST_ALL HSLT_TEST_KINDS
run 5 <<'TEXT'
skipped: e2e/bare.sh: no umbrella
skipped: e2e/part.sh: the roof: it rains
skipped: e2e/whole.sh: it rains
skipped: one/test_one: wet: no rain
2 passed, 0 failed, 4 skipped
TEXT
[ $CODE -eq 0 ] || fail "nothing failed, and it ended with $CODE"
export HSLT_TEST_ALL=1
run 4 <<'TEXT'
skipped: e2e/part.sh: the roof: it rains
skipped: e2e/whole.sh: it rains
skipped: one/test_one: wet: no rain
2 passed, 1 failed, 3 skipped
TEXT
[ $CODE -eq 1 ] || fail "a test that lacks something where all is installed: $CODE"
echo "what is skipped is named"
