# SPDX-License-Identifier: Apache-2.0
# tests/run.sh counts and names skipped tests, skipped parts of tests, and failed tests; where everything is installed a
# test that lacks something fails. An interrupted run leaves no process behind. The time limit of a test is its
# processor time, or a long time without any: a test does not fail because the machine is busy.
. "$(dirname "$0")/lib.sh"
LIMIT=$BUILD/tests/limit/limit
[ -x "$LIMIT" ] || lacks "$LIMIT is not built"
mkdir -p "$DIR/tests/e2e" "$DIR/build/tests/one" "$DIR/build/tests/limit"
cp "$LIMIT" "$DIR/build/tests/limit/"
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
[ -n "${HSLT_FLOOD:-}" ] || exit 0
echo '[  FAILED  ] tests: 2 test(s), listed below:'
echo '[  FAILED  ] deep'
echo '[  FAILED  ] deeper'
exit 2
TEXT
chmod +x "$DIR/build/tests/one/test_one"
run() {
	CODE=0
	sh "$DIR/tests/run.sh" "$DIR/build" >"$DIR/said" 2>"$DIR/err.log" || CODE=$?
	tail -n "$1" "$DIR/said" | sort >"$DIR/last"
	sort | diff - "$DIR/last" || fail "the last lines are other ones: $(cat "$DIR/said")"
}
unset HSLT_TEST_ALL HSLT_TEST_KINDS
for number in HSLT_TEST_JOBS=abc HSLT_TEST_JOBS=0 HSLT_TEST_CPU=-1 HSLT_TEST_IDLE=1.5; do
	code 2 env "$number" sh "$DIR/tests/run.sh" "$DIR/build"
	grep -qx "tests/run.sh: ${number%=*} is a whole number above 0, not '${number#*=}'" "$DIR/err.log" || fail "$number: $(cat "$DIR/err.log")"
done
run 5 <<'TEXT'
skipped: e2e/bare.sh: no umbrella
skipped: e2e/part.sh: the roof: it rains
skipped: e2e/whole.sh: it rains
skipped: one/test_one: wet: no rain
2 passed, 0 failed, 4 skipped
TEXT
[ $CODE -eq 0 ] || fail "nothing failed, and it ended with $CODE"
grep -q dry "$DIR/said" && fail "what passed was shown: $(cat "$DIR/said")"
grep -qx 'it is dry' "$DIR/build/tests/said/one/test_one.txt" || fail "what passed was not kept"
export HSLT_TEST_ALL=1 HSLT_TEST_VERBOSE=1
run 5 <<'TEXT'
failed: e2e/bare.sh: no umbrella
skipped: e2e/part.sh: the roof: it rains
skipped: e2e/whole.sh: it rains
skipped: one/test_one: wet: no rain
2 passed, 1 failed, 3 skipped
TEXT
grep -qx '   it is dry' "$DIR/said" || fail "what passed was not shown: $(cat "$DIR/said")"
[ $CODE -eq 1 ] || fail "a test that lacks something where all is installed: $CODE"
HSLT_FLOOD=1 HSLT_TEST_VERBOSE=0 run 6 <<'TEXT'
failed: e2e/bare.sh: no umbrella
failed: one/test_one: deep deeper
skipped: e2e/part.sh: the roof: it rains
skipped: e2e/whole.sh: it rains
skipped: one/test_one: wet: no rain
2 passed, 3 failed, 3 skipped
TEXT
[ $CODE -eq 1 ] || fail "two tests of a program failed: $CODE"

# An interrupted run ends its tests, whose processes hold the other end of a pipe, and starts no others.
mkdir -p "$DIR/slow/tests/one" "$DIR/tmp"
cp -r "$DIR/build/tests/limit" "$DIR/slow/tests/"
for i in 1 2 3; do
	printf '#!/bin/sh\necho >"%s/begun.%s"\nsleep 20\n' "$DIR" $i >"$DIR/slow/tests/one/test_$i"
done
chmod +x "$DIR"/slow/tests/one/*
{
	TMPDIR=$DIR/tmp HSLT_TEST_KINDS=unit HSLT_TEST_JOBS=1 sh "$DIR/tests/run.sh" "$DIR/slow" >"$DIR/said" 2>&1 &
	until [ -e "$DIR/begun.1" ]; do sleep 0.1; done
	kill $!
	wait $! || echo $? >"$DIR/code"
} 7>&1 | cat
[ "$(cat "$DIR/code")" = 130 ] || fail "a run that was ended: $(cat "$DIR/code" "$DIR/said")"
[ ! -e "$DIR/begun.2" ] || fail "a run that was ended goes on"
[ -z "$(ls "$DIR/tmp")" ] || fail "a run that was ended leaves $(ls "$DIR/tmp")"
rm "$DIR/code"

# limited CPU IDLE CODE SAID SCRIPT [ARGUMENT...]: checks how the script ends, and that none of its processes is left:
# they hold the other end of a pipe
limited() {
	wanted=$3 said=$4 CODE=0
	cpu=$1 idle=$2
	shift 4
	{ "$LIMIT" "$cpu" "$idle" sh -c "$@" >"$DIR/said" 2>"$DIR/err.log" || echo $? >"$DIR/code"; } 7>&1 | cat
	[ ! -s "$DIR/code" ] || CODE=$(cat "$DIR/code")
	rm -f "$DIR/code"
	{ [ $CODE -eq "$wanted" ] && cat "$DIR/said" "$DIR/err.log" | grep -q "$said"; } || fail "limit: $CODE: $(cat "$DIR/said" "$DIR/err.log")"
}
limited 60 60 3 yes 'echo yes; exit 3'
limited 60 60 137 yes 'echo yes; kill -9 $$'
limited 1 60 124 'has used the processor' 'while :; do :; done'
# Counts also processes that the test no longer waits for, and the sum of many short ones.
limited 1 60 124 'has used the processor' 'setsid sh -c "(while :; do :; done) & exec sleep 1000" & wait'
limited 1 60 124 'has used the processor' 'while :; do dd if=/dev/zero of=/dev/null bs=1M count=2000 2>/dev/null; done'
limited 60 2 124 'has been idle' 'sleep 1000'
limited 60 2 124 'has been idle' 'trap "" TERM; while :; do sleep 0.2; done & wait'
limited 60 2 124 'has been idle' 'kill -STOP $$'
limited 60 2 0 last 'for i in 1 2 3 4 5 6; do echo $i; sleep 0.7; done; echo last'
# On a processor that another process occupies, for three times the idle limit: about 30 ms of work per second, or less.
one=$(taskset -cp $$ | sed 's/.*: //; s/[-,].*//')
taskset -c "$one" timeout 6 sh -c 'while :; do :; done' &
limited 60 2 0 done 'exec taskset -c "$0" chrt --idle 0 sh -c "i=0; while [ \$i -lt 300000 ]; do i=\$((i + 1)); done; echo done"' "$one"
echo "what is skipped is named, and limits hold"
