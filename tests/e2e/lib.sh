# SPDX-License-Identifier: Apache-2.0
# For end-to-end tests with real processes on loopback: sourced by tests/e2e/*.sh, which are called with the build
# folder. Each test has a folder of its own and ends the processes that it started; HSLT_KEEP=FOLDER copies the folder
# there. Exit codes: 0 passed, 77 skipped, else failed.
set -eu

# A test that mounts sets OWN_MOUNTS before it sources this file, and is then restarted in a mount namespace of its own,
# with HSLT_OWN_MOUNTS=1. If there can be none, the test is skipped if OWN_MOUNTS is "needed", and runs without it if
# "wanted".
if [ -n "${OWN_MOUNTS:-}" ] && [ -z "${HSLT_OWN_MOUNTS:-}" ]; then
	if unshare -rm true 2>/dev/null; then
		HSLT_OWN_MOUNTS=1 exec unshare -rm sh "$0" "$@"
	elif [ "$OWN_MOUNTS" = needed ]; then
		echo "skipped: no name spaces for mounts here"
		exit 77
	fi
fi

BUILD=${1:-build}
BIN=$BUILD/bin
HERE=$(dirname "$0")
BOX=$HERE/../scenes/box/box.xml
DIR=$(mktemp -d "${TMPDIR:-/tmp}/hslt-e2e.XXXXXX")
TOP=$DIR # DIR may become a folder in it
PIDS=
COORDINATOR=
COORDINATOR_PID=
export HSLT_STATUS_SOCKET="$DIR/status"
export LC_ALL=C.UTF-8 # numbers of awk and sleep have points

finish() {
	code=$?
	trap - EXIT INT TERM
	for p in $PIDS; do
		kill -9 "$p" 2>/dev/null || :
	done
	wait 2>/dev/null || :
	if grep -l 'runtime error:\|ERROR: .*Sanitizer' "$TOP"/*.log "$DIR"/*.log 2>/dev/null; then
		code=1
	fi
	if [ $code -ne 0 ] && [ $code -ne 77 ]; then
		for f in "$DIR"/*.log; do
			[ -s "$f" ] && echo "---- $(basename "$f")" && tail -n 15 "$f"
		done
	fi
	# Lazily: the render process ends a moment after its supervisor, and has the cache open until then.
	[ -z "${HSLT_OWN_MOUNTS:-}" ] || umount -l "$DIR/spool" "$DIR/disk" 2>/dev/null || :
	[ -z "${HSLT_KEEP:-}" ] || cp -r "$TOP" "$HSLT_KEEP"
	rm -rf --one-file-system "$TOP"
	exit $code
}
trap finish EXIT
trap 'exit 130' INT TERM

fail() {
	echo "FAILED: $*"
	exit 1
}

skip() {
	echo "skipped: $*"
	exit 77
}

# lacks WHAT: skips the test, because something is missing that deploy/setup.sh --full installs or make builds. Where
# all is installed (HSLT_TEST_ALL=1: deploy/test.sh --full and --ci) that is a failure.
lacks() {
	[ -z "${HSLT_TEST_ALL:-}" ] || fail "$*"
	skip "$*"
}

# skip_part WHY: the remaining parts are tested; tests/run.sh counts and names skipped parts
skip_part() {
	echo "skipped in part: $*"
}

# need PROGRAM...: without these programs the test is skipped
need() {
	for p in "$@"; do
		[ -x "$BIN/$p" ] || lacks "$p is not built"
	done
}

# For tests that run in Debian systems of their own.
need_debians() {
	[ "${FULL:-0}" != 0 ] || skip "downloads Debians: FULL=1, or deploy/test.sh --full"
	command -v debootstrap >/dev/null || lacks "no debootstrap (deploy/setup.sh --full installs it)"
	[ "$(id -u)" = 0 ] || skip "debootstrap wants root"
	unshare --mount --pid --fork true 2>/dev/null || skip "no namespaces for mounts and processes here"
}

# fresh_debian SUITE ROOT: what debootstrap mounts there (/proc, which it sometimes leaves behind) stays in a namespace
# of its own.
fresh_debian() {
	unshare --mount debootstrap --variant=minbase "$1" "$2" "${HSLT_DEBIAN_MIRROR:-http://deb.debian.org/debian}" >"$DIR/debootstrap.log" 2>&1 ||
		skip "debootstrap: $(tail -n 1 "$DIR/debootstrap.log")"
	cp /etc/resolv.conf /etc/hosts "$2/etc/"
}

# inside ROOT COMMAND [USER]: runs the command with /proc and with the network's names; ends all processes afterwards
inside() {
	unshare --mount --pid --fork --kill-child sh -c 'mount -t proc proc "$1/proc" && mount --rbind /dev "$1/dev" && exec chroot \
		${3:+--userspec="$3"} "$1" /usr/bin/env -i PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin sh -ec "$2"' \
		sh "$1" "$2" "${3:-}" >>"$DIR/inside.log" 2>&1
}

# code WANTED COMMAND...: checks the exit code; the output is in out and err.log
code() {
	wanted=$1
	shift
	got=0
	"$@" >"$DIR/out" 2>"$DIR/err.log" || got=$?
	[ $got -eq "$wanted" ] || fail "$* ended with $got, not $wanted: $(cat "$DIR/out" "$DIR/err.log")"
}

# until_true SECONDS COMMAND...: waits for the command to succeed. SECONDS is the limit on an idle machine; a busy one
# has fifty times that.
until_true() {
	tries=$(($1 * 1000))
	shift
	while ! "$@"; do
		tries=$((tries - 1))
		[ $tries -gt 0 ] || return 1
		sleep 0.05
	done
}

# free_ports COUNT: finds so many consecutive unused ports below those that the kernel assigns (from 32768); the first
# one is in port. Tests that run at the same time look in different ranges: tests/run.sh runs three scripts at once,
# with HSLT_TEST_SLOT from 0 to 2.
free_ports() {
	first_port=$((10000 + ${HSLT_TEST_SLOT:-0} % 3 * 7000))
	port=$((first_port + $$ * 4 % 6000))
	while [ $port -lt $((first_port + 6990)) ]; do
		busy=0
		for k in $(seq 0 $(($1 - 1))); do
			hex=$(printf ':%04X ' $((port + k)))
			! cat /proc/net/tcp /proc/net/tcp6 2>/dev/null | grep -q "$hex" || busy=1
		done
		[ $busy = 1 ] || return 0
		port=$((port + $1))
	done
	fail "no $1 free ports in a row from $first_port to $((first_port + 6990))"
}

# has_read: the coordinator has read the jobs from before its restart, or has ended
has_read() {
	! "$BIN/hslt-status" --json 2>/dev/null | grep -q '"reading": *[0-9]'
}

# listens: waits until the coordinator, which was started as $!, listens
listens() {
	COORDINATOR_PID=$!
	PIDS="$PIDS $COORDINATOR_PID"
	until_true 10 test -s "$DIR/port" || fail "the coordinator does not listen"
	COORDINATOR=127.0.0.1:$(cat "$DIR/port")
	export HSLT_COORDINATOR="$COORDINATOR"
}

# listen [OPTION...]: starts the coordinator at $LISTEN, or at any free port
listen() {
	rm -f "$DIR/port"
	"$BIN/hslt-coordinator" --listen "${LISTEN:-127.0.0.1:0}" --port-file "$DIR/port" --spool "$DIR/spool" \
		--status-socket "$DIR/status" --heartbeat 0.5 "$@" 2>>"$DIR/coordinator.log" &
	listens
}

# start_coordinator [OPTION...]: returns once it has read its jobs
start_coordinator() {
	listen "$@"
	until_true 60 has_read || fail "the coordinator does not read its jobs"
}

# start_worker NAME [OPTION...]: starts a worker; its process id is in WORKER
start_worker() {
	name=$1
	shift
	"$BIN/hslt-worker" --threads 1 --name "$name" --cache "$DIR/cache" "$@" 2>>"$DIR/$name.log" &
	WORKER=$!
	PIDS="$PIDS $WORKER"
}

build_id() {
	LC_ALL=C readelf -n "$1" | sed -n 's/.*Build ID: //p'
}

# start_faulty_worker NAME FAULTS [OPTION...]: starts a worker with these faults (faulty_worker.c). If its build id
# differed from hslt-worker's, so would its numeric fingerprint, and it would never get a lease of a job that
# hslt-worker has begun.
start_faulty_worker() {
	name=$1 faults=$2
	shift 2
	[ -x "$BUILD/tests/e2e/faulty_worker" ] || fail "no $BUILD/tests/e2e/faulty_worker; make tests builds it"
	[ "$(build_id "$BUILD/tests/e2e/faulty_worker")" = "$(build_id "$BIN/hslt-worker")" ] ||
		fail "$BUILD/tests/e2e/faulty_worker and hslt-worker are of different builds; make tests builds it again"
	HSLT_FAULTS=$faults "$BUILD/tests/e2e/faulty_worker" --threads 1 --name "$name" --cache "$DIR/cache" "$@" 2>>"$DIR/$name.log" &
	WORKER=$!
	PIDS="$PIDS $WORKER"
}

# renders PID: prints the process that renders for this worker, once there is one; the worker itself only supervises it
renders() {
	until_true 30 grep -q . "/proc/$1/task/$1/children" || fail "worker $1 starts no process that renders" >&2
	tr -d ' ' <"/proc/$1/task/$1/children"
}

# stop PID...: sends SIGTERM, and waits; the exit code is in CODE
stop() {
	for p in "$@"; do
		kill "$p"
		CODE=0
		wait "$p" || CODE=$?
	done
}

# submit OPTION...: prints the job's id
submit() {
	"$BIN/hslt-submit" "$@" 2>>"$DIR/submit.log"
}

# value JOB KEY: prints a number or a word of the job's JSON; the first one of that name
value() {
	"$BIN/hslt-status" --json "$1" 2>/dev/null | grep -o '"'"$2"'":"\{0,1\}[^",{}]*' | sed -n 's/^[^:]*:"\{0,1\}\(..*\)/\1/p' |
		head -n 1
}

# is_beyond JOB PROGRESS: the job's progress exceeds PROGRESS
is_beyond() {
	awk -v a="$(value "$1" progress)" -v b="$2" 'BEGIN { exit !(a + 0 >= b + 0) }'
}

is_state() {
	[ "$(value "$1" state)" = "$2" ]
}

# write_table NAME FILE: writes the rows into README.md, between the marks of that name
write_table() {
	{
		sed "/<!-- $1 -->/q" "$HERE/README.md"
		cat "$2"
		sed -n "/<!-- $1 -->/,\$p" "$HERE/README.md" | sed -n '/<!-- end -->/,$p'
	} >"$TOP/readme.new"
	cat "$TOP/readme.new" >"$HERE/README.md"
}

# same A B: compares every bit of every pixel, and the header except for fields that may differ
same() {
	"$BIN/hslt-compare" --exact "$1" "$2" || fail "$1 and $2 differ"
}
