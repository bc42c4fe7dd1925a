# SPDX-License-Identifier: Apache-2.0
# deploy/slurm/farm.sbatch without Slurm and without a farm: stub programs end as they are told. Checks the exit code of
# the script, and when it deletes the spool: with the image, with a job that failed, or if there is no job in it.
# tests/e2e/slurm.sh uses the real programs.
. "$(dirname "$0")/lib.sh"
command -v bash >/dev/null || skip "no bash"
SBATCH=$(cd "$HERE/../../deploy/slurm" && pwd)/farm.sbatch
PROGRAMS=$DIR/programs
mkdir "$PROGRAMS" "$DIR/shared" "$DIR/tmp"
export DIR

# program NAME: installs the script on stdin under that name
program() {
	{
		echo '#!/bin/sh'
		cat
	} >"$PROGRAMS/$1"
	chmod +x "$PROGRAMS/$1"
}

program scontrol <<'TEXT'
echo "NodeName=n1 NodeAddr=127.0.0.1"
TEXT
program srun <<'TEXT'
while [ "$1" != sh ]; do shift; done
exec "$@"
TEXT
# Ends the workers; with AGAIN the script gets another signal meanwhile.
program scancel <<'TEXT'
[ -z "$AGAIN" ] || kill -TERM $PPID
kill -TERM "$(cat "$DIR/worker.pid")"
TEXT
# Files of another owner cannot be removed.
program rm <<'TEXT'
case "$*" in *"$DIR/tmp/hslt-farm-7.0") [ -z "$FOREIGN" ] || exit 1 ;; esac
exec /bin/rm "$@"
TEXT
# While the coordinator is slow to start, a second of sleep is short.
program sleep <<'TEXT'
echo "$1" >>"$DIR/naps"
[ "$(wc -l <"$DIR/naps")" -ge "${NAPS:-0}" ] && exec /bin/sleep "$1"
exec /bin/sleep 0.01
TEXT
program hslt-coordinator <<'TEXT'
while [ $# -gt 0 ]; do
	case $1 in --spool) spool=$2 ;; --port-file) port=$2 ;; esac
	shift
done
echo $$ >"$DIR/coordinator.pid"
mkdir -p "$spool"
until [ -z "$NAPS" ] || [ "$(wc -l <"$DIR/naps")" -ge "$NAPS" ]; do /bin/sleep 0.02; done
echo 7700 >"$port"
exec /bin/sleep 600
TEXT
# The worker takes a moment to leave.
program hslt-worker <<'TEXT'
trap '/bin/sleep 0.05; echo left >>"$DIR/worker.left"; kill $p; exit 0' TERM
/bin/sleep 600 &
p=$!
echo $$ >"$DIR/worker.pid"
wait
TEXT
# list_of STATE CODE RESULT: prints hslt-job's answer
cat >"$DIR/list_of" <<'TEXT'
printf '[\n  {\n    "id": "j1",\n    "state": "%s",\n    "exitCode": %s,\n    "result": %s\n  }\n]\n' "$@" >"$DIR/list"
TEXT
program hslt-submit <<'TEXT'
echo $$ >"$DIR/submit.pid"
[ "$SUBMIT" = 2 ] || sh "$DIR/list_of" ${JOB:-running 0 false}
case $SUBMIT in
wait) exec /bin/sleep 600 ;;
leave) kill "$(cat "$DIR/worker.pid")" && exec /bin/sleep 600 ;;
TERM) kill -TERM $$ ;;
*) exit "$SUBMIT" ;;
esac
TEXT
program hslt-job <<'TEXT'
case "$*" in
*list*)
	echo list >>"$DIR/asked"
	[ "$(wc -l <"$DIR/asked")" != "$LIST_DIES" ] || kill -TERM $$
	cat "$DIR/list"
	[ -z "$THEN" ] || sh "$DIR/list_of" $THEN
	;;
*--preview*) exit 1 ;;
*fetch*)
	[ "$FETCH" != TERM ] || kill -TERM $$
	exit "$FETCH"
	;;
esac
TEXT

export PATH="$PROGRAMS:$PATH" TMPDIR="$DIR/tmp" HSLT_SPOOL="$DIR/shared" HSLT_GRACE=2.5 SLURM_JOB_ID=7 SLURM_RESTART_COUNT=0 SLURMD_NODENAME=n1 SLURM_CPUS_ON_NODE=1
export SUBMIT=0 FETCH=0 JOB= NAPS= LIST_DIES= THEN= AGAIN= FOREIGN=
unset HSLT_BIN HSLT_CA HSLT_INSECURE SLURM_CPUS_PER_TASK

# run_batch CODE SPOOL [NAME=VALUE...]: checks the exit code, and whether the spool is "kept" or "gone"
run_batch() {
	wanted=$1 spool=$2
	shift 2
	rm -f "$DIR"/*.pid "$DIR/worker.left" "$DIR/asked" "$DIR/naps"
	: >"$DIR/naps"
	got=0
	env "$@" bash "$SBATCH" box.xml -o image.exr >"$DIR/sbatch.log" 2>&1 || got=$?
	[ "$got" = "$wanted" ] || fail "it ended with $got, not with $wanted: $*"
	[ -d "$DIR/shared/hslt-farm-7" ] && found=kept || found=gone
	[ $found = "$spool" ] || fail "the spool is $found: $*"
	[ $spool = gone ] || says "stays in n1:$DIR/shared/hslt-farm-7.*scontrol requeue 7"
	rm -rf "$DIR/shared/hslt-farm-7"
	for p in "$DIR"/*.pid; do
		! kill -0 "$(cat "$p")" 2>/dev/null || fail "$(basename "$p" .pid) was left behind: $*"
	done
	[ -s "$DIR/worker.left" ] || fail "the worker was not left to leave: $*"
	! grep -q "Killed\|syntax" "$DIR/sbatch.log" || fail "it was in a hurry: $*"
	[ -z "$(ls -A "$DIR/tmp")" ] || fail "it left $(ls -A "$DIR/tmp"): $*"
}

says() {
	grep -q -- "$1" "$DIR/sbatch.log" || fail "it does not say '$1'"
}

# first: there is no job in the spool yet; next STATE CODE RESULT: an earlier start left one
first() {
	echo '[]' >"$DIR/list"
	run_batch "$@"
}
next() {
	sh "$DIR/list_of" "$1" "$2" "$3"
	shift 3
	run_batch "$@"
}

# ---- the first start ----

for code in 0 4 5; do
	first $code gone SUBMIT=$code JOB="done $code true"
done
first 3 gone SUBMIT=3 JOB="failed 3 false"
first 2 gone SUBMIT=2
# The image is rendered but cannot be written; or hslt-submit is refused, or finds no coordinator, with a job in the
# spool.
for code in 1 6 75; do
	first $code kept SUBMIT=$code JOB="done 0 true"
done
first 1 kept SUBMIT=1 LIST_DIES=2
first 143 kept SUBMIT=TERM
first 143 kept SUBMIT=leave # without its hslt-submit
first 0 gone AGAIN=1 # a signal while everything ends
first 0 gone NAPS=150 # as often as 0.1 s are in 15 s
[ "$(grep -c '^0.1$' "$DIR/naps")" -ge 150 ] || fail "the coordinator was not slow, this tests nothing"

# ---- the next start ----

next done 0 true 0 gone
says "continues from an earlier start"
next done 5 true 5 gone
next running 0 false 3 gone THEN="failed 3 false" FETCH=1
next failed 3 false 0 gone SUBMIT=0 JOB="done 0 true" FETCH=1 # the start before ended while it submitted
next done 0 true 1 kept FETCH=1
next done 0 true 75 kept FETCH=75
next done 0 true 143 kept FETCH=TERM
for ask in 1 2; do # state, exitCode
	next done 0 true 143 kept LIST_DIES=$ask
done

# ---- folders in /tmp ----

# Folders of that name that belong to another user
mkdir "$DIR/tmp/hslt-farm-7.0"
echo '[]' >"$DIR/list"
env FOREIGN=1 bash "$SBATCH" box.xml -o image.exr >"$DIR/sbatch.log" 2>&1 || fail "a foreign folder ends it"
[ -z "$(ls -A "$DIR/tmp/hslt-farm-7.0")" ] || fail "it uses a foreign folder"
/bin/rm -r "$DIR/tmp"/*
# Without a file system that all nodes share, an image that could not be written stays where it is.
echo '[]' >"$DIR/list"
env HSLT_SPOOL= SUBMIT=1 bash "$SBATCH" box.xml -o image.exr >"$DIR/sbatch.log" 2>&1 && fail "an image that cannot be written ends with 0"
[ -d "$DIR/tmp"/hslt-farm-7.0.*/spool ] || fail "the image is gone: $(ls -R "$DIR/tmp")"
! grep -q requeue "$DIR/sbatch.log" || fail "it promises what it cannot do"
echo "farm.sbatch: exit codes, and the spool goes with the image only"
