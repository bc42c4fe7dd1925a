# SPDX-License-Identifier: Apache-2.0
# deploy/systemd: systemd finds no error in the units and little exposure; the daemons make only system calls that the
# units allow; with a socket, a watchdog and a notification socket as from systemd, the coordinator does its part.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status
for p in systemd-analyze systemd-socket-activate socat; do
	command -v $p >/dev/null || lacks "no $p (deploy/setup.sh --full installs systemd and socat)"
done
BIN=$(cd "$BIN" && pwd)
UNITS=$HERE/../../deploy/systemd
MOST=2.5

# ---- what systemd says about the files ----

mkdir "$DIR/units"
for f in "$UNITS"/*.service "$UNITS"/*.socket; do
	sed "s|/usr/local/bin/|$BIN/|" "$f" >"$DIR/units/$(basename "$f")"
done
HOME_FOLDER=$PWD
cd "$DIR/units"
systemd-analyze verify ./hslt-coordinator.service ./hslt-coordinator.socket ./hslt-worker@.service >"$DIR/verify" 2>&1 ||
	fail "systemd-analyze verify ended with $?: $(cat "$DIR/verify")"
[ ! -s "$DIR/verify" ] || fail "systemd-analyze verify: $(cat "$DIR/verify")"
for u in *.service; do
	level=$(systemd-analyze security --offline=true "./$u" | sed -n 's/.*Overall exposure level for .*: \([0-9.]*\) .*/\1/p')
	echo "$u: exposure $level"
	awk -v a="$level" -v b=$MOST 'BEGIN { exit !(a != "" && a + 0 <= b) }' || fail "$u is exposed: '$level', at most $MOST"
done
sed -i '/^ExecStart/s|=.*|=/none/such|' hslt-worker@.service
systemd-analyze verify ./hslt-worker@.service >/dev/null 2>&1 && fail "verify does not look"
# The time for reading jobs depends only on their size: a timeout would stop each start again.
grep -qx 'TimeoutStartSec=infinity' hslt-coordinator.service || fail "the coordinator's start has a limit"
cd "$HOME_FOLDER"

# Options in the units and examples must be options of the programs.
for f in "$UNITS"/*.service "$UNITS"/*.example; do
	program=$(basename "$f" | sed 's/^hslt-//; s/[@.].*//')
	for o in $(grep '^ExecStart\|HSLT_OPTIONS' "$f" | grep -o -e ' --[a-z-]*\|=--[a-z-]*' | tr -d ' ='); do
		"$BIN/hslt-$program" --help | grep -q -e " $o[ =]" || fail "$(basename "$f"): hslt-$program has no $o"
	done
done

# ---- system calls ----

# Expands the sets of system calls that begin with @ to their names.
syscalls() {
	for s in "$@"; do
		case $s in
		@*) syscalls $(systemd-analyze syscall-filter "$s" | sed -n 's/^ *\([@a-z0-9_-]*\)$/\1/p' | grep -vx "$s") ;;
		*) echo "$s" ;;
		esac
	done
}

command -v strace >/dev/null || lacks "no strace (deploy/setup.sh --full installs it)"
TRACE=
# Sanitizers make system calls of their own, and their leak check fails under a tracer.
if grep -q __asan_init "$BIN/hslt-worker"; then
	skip_part "system calls: those of programs with sanitizers are others"
elif strace -f -c -U name -o "$DIR/try" true 2>/dev/null && grep -q "^total" "$DIR/try"; then
	TRACE="strace -D -f -c -U name -o"
else
	skip_part "system calls: strace may not trace here"
fi

# within UNIT TRACE-FILE: all traced system calls are allowed by the unit
within() {
	until_true 10 grep -q '^total' "$2" || fail "no list of system calls of $1: $(cat "$2")"
	sed -n 's/^\([a-z0-9_]*\) *$/\1/p' "$2" | grep -vx 'syscall\|total' | sort -u >"$DIR/called"
	[ "$(wc -l <"$DIR/called")" -ge 20 ] || fail "only these calls of $1? $(cat "$DIR/called")"
	sed -n 's/^SystemCallFilter=\([^~].*\)/\1/p' "$UNITS/$1" >"$DIR/filter"
	syscalls $(cat "$DIR/filter") | sort -u >"$DIR/with"
	sed -n 's/^SystemCallFilter=~\(.*\)/\1/p' "$UNITS/$1" >"$DIR/filter"
	syscalls $(cat "$DIR/filter") | sort -u >"$DIR/without"
	comm -23 "$DIR/with" "$DIR/without" >"$DIR/allowed"
	# SQLite calls fchown when it runs as root, as a test may and the service does not; it tolerates a refusal.
	refused=$(comm -23 "$DIR/called" "$DIR/allowed" | grep -vx fchown | tr '\n' ' ')
	[ -z "$refused" ] || fail "$1 refuses what the program calls: $refused"
	echo "$1: $(wc -l <"$DIR/called") system calls, all let through"
}

# ---- started as by systemd ----

socat -u "UNIX-RECV:$DIR/notify" "OPEN:$DIR/heard,creat,append" 2>>"$DIR/socat.log" &
PIDS="$PIDS $!"
until_true 5 test -S "$DIR/notify" || fail "nobody to notify"
systemd-socket-activate -l "$DIR/status" -E NOTIFY_SOCKET="$DIR/notify" -E WATCHDOG_USEC=900000 \
	${TRACE:+$TRACE "$DIR/coordinator.trace"} "$BIN/hslt-coordinator" --listen 127.0.0.1:0 --port-file "$DIR/port" \
	--spool "$DIR/spool" 2>>"$DIR/coordinator.log" &
COORDINATOR_PID=$!
PIDS="$PIDS $COORDINATOR_PID"
# The socket's file exists a moment before the socket listens.
connects() {
	"$BIN/hslt-status" >"$DIR/shown" 2>"$DIR/connect.log" || ! grep -q 'No such file\|refused' "$DIR/connect.log"
}
until_true 5 connects && [ -s "$DIR/shown" ] || fail "the connection that starts the coordinator is not answered: $(cat "$DIR/connect.log")"
until_true 5 grep -q READY=1 "$DIR/heard" || fail "it did not say that it is ready"
HSLT_COORDINATOR=127.0.0.1:$(cat "$DIR/port")
export HSLT_COORDINATOR
socat -u "UNIX-RECV:$DIR/notify2" "OPEN:$DIR/heard2,creat,append" 2>>"$DIR/socat.log" &
PIDS="$PIDS $!"
until_true 5 test -S "$DIR/notify2" || fail "nobody to notify"
NOTIFY_SOCKET=$DIR/notify2 WATCHDOG_USEC=900000 ${TRACE:+$TRACE "$DIR/worker.trace"} "$BIN/hslt-worker" --threads 2 --name one --cache "$DIR/cache" 2>>"$DIR/worker.log" &
WORKER=$!
PIDS="$PIDS $WORKER"
submit "$BOX" -o "$DIR/unit.exr" --integrator hslt --bootstrap 20000 --mutations 60000 --wait >/dev/null || fail "the job: $?"
until_true 5 grep -q 'WATCHDOG=1.*WATCHDOG=1' "$DIR/heard" || fail "the watchdog hears nothing: $(cat "$DIR/heard")"
until_true 5 grep -q 'WATCHDOG=1.*WATCHDOG=1' "$DIR/heard2" || fail "the worker's watchdog hears nothing: $(cat "$DIR/heard2")"
until_true 5 grep -q '^READY=1' "$DIR/heard2" || fail "the worker said $(cat "$DIR/heard2")"
if [ "$(id -u)" = 0 ]; then
	for f in coordinator worker; do
		grep -q 'level=warn event=runs_as_root' "$DIR/$f.log" || fail "no warning that the $f runs as root"
	done
fi
stop $WORKER
[ $CODE -eq 0 ] || fail "the worker ended with $CODE"
until_true 5 grep -q 'STOPPING=1$' "$DIR/heard2" || fail "the worker said $(cat "$DIR/heard2")"
stop $COORDINATOR_PID
[ $CODE -eq 0 ] || fail "the coordinator ended with $CODE"
until_true 5 grep -q '^READY=1.*STOPPING=1$' "$DIR/heard" || fail "it said $(cat "$DIR/heard")"
[ -S "$DIR/status" ] || fail "the socket that it was given is gone"
if [ -n "$TRACE" ]; then
	within hslt-coordinator.service "$DIR/coordinator.trace"
	within hslt-worker@.service "$DIR/worker.trace"
fi
