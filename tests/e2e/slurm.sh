# SPDX-License-Identifier: Apache-2.0
# deploy/slurm on a cluster of three nodes with its own slurmctld, slurmds and munged, on loopback, in a temporary
# folder: workers start, are told to leave, are preempted, are requeued from a node whose daemon is dead, and exit when
# there is no work; a whole farm is requeued, and one is cut short. All over TLS. The images have the bits of
# hslt-render's, and each loss repeats at most one epoch of a chain.
. "$(dirname "$0")/lib.sh"
need hslt-ca hslt-coordinator hslt-worker hslt-submit hslt-status hslt-job hslt-render hslt-compare
PATH=$PATH:/usr/sbin:/sbin
for p in munged slurmctld slurmd sbatch; do
	command -v $p >/dev/null || lacks "no $p (deploy/setup.sh --full installs slurm-wlm and munge)"
done
[ "$(id -u)" = 0 ] || skip "slurmd wants root"
! grep -q __asan_init "$BIN/hslt-worker" || skip "programs with sanitizers take too long for it"
command -v runuser >/dev/null && id munge >/dev/null 2>&1 || lacks "no runuser, or no user munge (of the package munge)"

BIN=$(cd "$BIN" && pwd)
DEPLOY=$(cd "$HERE/../../deploy" && pwd)
BOX=$(cd "$HERE/../scenes/box" && pwd)/box.xml
LONG="--integrator hslt --bootstrap 20000 --epoch 200 --mutations 6000000"
SHORT="--integrator hslt --bootstrap 20000 --epoch 50 --mutations 1000000"

# Processes that were started here, by the test or by Slurm, have the folder in their environment.
ours() {
	grep -lzF "SLURM_CONF=$DIR/" /proc/[0-9]*/environ 2>/dev/null | sed -n 's/^\/proc\/\([0-9]*\)\/.*/\1/p' | grep -vx $$ || :
}

end_cluster() {
	for round in 1 2 3; do
		left=$(ours)
		[ -n "$left" ] || break
		kill -9 $left 2>/dev/null || :
		sleep 0.1
	done
	[ ! -s "$DIR/munge/pid" ] || kill -9 "$(cat "$DIR/munge/pid")" 2>/dev/null || :
}
end_all() {
	code=$?
	set +e
	end_cluster
	(exit $code)
	finish
}
trap end_all EXIT

start_cluster() {
	free_ports 4
	host=$(hostname -s)
	mkdir -p "$DIR/munge" "$DIR/state" "$DIR/slurmd"
	chmod 711 "$DIR"
	head -c 128 /dev/urandom >"$DIR/munge/key"
	chmod 400 "$DIR/munge/key"
	chown -R munge "$DIR/munge"
	runuser -u munge -- munged --force --key-file="$DIR/munge/key" --socket="$DIR/munge/socket" --pid-file="$DIR/munge/pid" \
		--log-file="$DIR/munge/log" --seed-file="$DIR/munge/seed" >"$DIR/munged.log" 2>&1 || fail "munged does not start"
	cat >"$DIR/slurm.conf" <<TEXT
ClusterName=hslt
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmdUser=root
SlurmctldPort=$port
AuthType=auth/munge
AuthInfo=socket=$DIR/munge/socket
CredType=cred/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerType=sched/backfill
SchedulerParameters=bf_interval=1,sched_interval=1,batch_sched_delay=0,sched_min_interval=0
StateSaveLocation=$DIR/state
SlurmdSpoolDir=$DIR/slurmd/%n
SlurmctldPidFile=$DIR/slurmctld.pid
SlurmdPidFile=$DIR/slurmd-%n.pid
SlurmctldLogFile=$DIR/slurmctld.log
SlurmdLogFile=$DIR/slurmd-%n.log
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/none
KillWait=60
MessageTimeout=100
BatchStartTimeout=100
MinJobAge=300
SlurmdTimeout=60
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 1)) CPUs=1 RealMemory=64 State=UNKNOWN
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 2)) CPUs=1 RealMemory=64 State=UNKNOWN
NodeName=n3 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 3)) CPUs=1 RealMemory=64 State=UNKNOWN
PreemptType=preempt/partition_prio
PreemptMode=REQUEUE
PartitionName=render Nodes=n[1-3] Default=YES MaxTime=INFINITE State=UP PriorityTier=1
PartitionName=urgent Nodes=n[1-3] MaxTime=INFINITE State=UP PriorityTier=2
TEXT
	export SLURM_CONF="$DIR/slurm.conf"
	slurmctld -c
	for n in n1 n2 n3; do
		slurmd -N $n
	done
	until_true 20 idle 3 || fail "the cluster does not come up: $(sinfo 2>&1)"
}

idle() {
	[ "$(sinfo -h -o %D -t idle 2>/dev/null)" = "$1" ]
}

# batch OPTION...: submits a Slurm job; its id is in JOB
batch() {
	JOB=$(sbatch --parsable --output="$DIR/%j.log" "$@") || fail "sbatch $*"
	JOB=${JOB%%;*}
}

job_state() {
	scontrol show job "$1" 2>/dev/null | sed -n 's/.*JobState=\([A-Z]*\).*/\1/p' | head -n 1
}

is_job() {
	[ "$(job_state "$1")" = "$2" ]
}

job_field() {
	scontrol show job "$1" | sed -n "s/.* *$2=\([^ ]*\).*/\1/p" | head -n 1
}

# Prints the names of the workers at the coordinator, one per line.
workers() {
	"$BIN/hslt-status" --json 2>/dev/null | sed 's/.*"workers":\[//; s/\],"leases":\[.*//' | grep -o '"name":"[^"]*"' | sed 's/.*:"//; s/"//'
}

has_workers() {
	[ "$(workers | wc -l)" = "$1" ]
}

has_worker() {
	workers | grep -q "$1"
}

pause() {
	"$BIN/hslt-job" "$1" "$id" 2>>"$DIR/submit.log" || fail "hslt-job $1 $id"
}

# requeued JOB: the job waits for its next start, which is moved from two minutes later to now
requeued() {
	until_true 60 is_job "$1" PENDING || return 1
	sleep 2 # a slurmd kills a job that restarts within the second in which the slurmd was told to end it
	scontrol update JobId="$1" StartTime=now
	until_true 60 is_job "$1" RUNNING
}

# ---- elastic workers ----

for kind in long short; do
	[ $kind = long ] && options=$LONG || options=$SHORT
	"$BIN/hslt-render" "$BOX" -o "$DIR/$kind.exr" $options --threads 2 2>>"$DIR/render.log" || fail "hslt-render"
done
start_cluster
export HSLT_BIN="$BIN" HSLT_CACHE="$DIR/cache" TMPDIR="$DIR" HSLT_IDLE=4
# Each program gets a certificate for its role.
export HSLT_CA="$DIR/ca"
{ "$BIN/hslt-ca" init && "$BIN/hslt-ca" worker worker && "$BIN/hslt-ca" client client; } >>"$DIR/ca.log" 2>&1 || fail "hslt-ca"
export HSLT_TLS="$HSLT_CA/client"
start_coordinator --verbose --tls "$HSLT_CA/coordinator"
id=$(submit "$BOX" -o "$DIR/elastic.exr" $LONG)
# A waiting worker gets leases of this job meanwhile, and does not exit.
filler=$(submit "$BOX" -o "$DIR/filler.exr" --integrator path --spp 1000000 --epoch 4 --priority -100)
batch --array=1 --export="ALL,HSLT_TLS=$HSLT_CA/worker,HSLT_GRACE=0" "$DEPLOY/slurm/workers.sbatch"
first=$JOB
until_true 20 has_workers 1 || fail "no worker came: $(squeue 2>&1)"
until_true 30 is_beyond "$id" 0.1 || fail "$id does not get on with one worker"

batch --array=2-3 --export="ALL,HSLT_TLS=$HSLT_CA/worker" "$DEPLOY/slurm/workers.sbatch"
second=$JOB
until_true 20 has_workers 3 || fail "three workers do not come: $(workers)"
until_true 30 is_beyond "$id" 0.2 || fail "$id does not get on with three workers"

scancel --batch --signal=TERM "${second}_2"
until_true 20 is_job "${second}_2" COMPLETED || fail "the worker that was told to leave is $(job_state "${second}_2")"
until_true 5 has_workers 2 || fail "it stays at the coordinator"

# A job of higher priority needs the first worker's node; the worker leaves in a hurry and comes back when the node is
# free.
batch --partition=urgent --nodelist="$(job_field "${first}_1" BatchHost)" --wrap "sleep 1"
urgent=$JOB
until_true 10 is_job "$urgent" RUNNING || fail "the urgent job is $(job_state "$urgent"): $(squeue)"
pause hold # Slurm is slow, and the job must not end before
requeued "${first}_1" || fail "the worker that was preempted is $(job_state "${first}_1")"
until_true 10 has_worker "^${first}_1\.1@" || fail "the preempted worker does not come back: $(workers)"
pause release

# The daemon of a node dies while its worker runs on; Slurm gives the node up and starts the worker elsewhere.
node=$(job_field "${second}_3" BatchHost)
kill -9 "$(cat "$DIR/slurmd-$node.pid")"
scontrol update NodeName="$node" State=DOWN Reason=test
pause hold
requeued "${second}_3" || fail "the worker of the lost node is $(job_state "${second}_3")"
until_true 10 has_worker "^${second}_3\.1@" || fail "the worker does not come back: $(workers)"
has_worker "^${second}_3\.0@$node" || fail "the old worker on $node is gone, this tests nothing"
pause release
is_beyond "$id" 0.95 && fail "$id was too fast, this tests nothing"
until_true 60 is_state "$id" done || fail "$id is $(value "$id" state)"
"$BIN/hslt-job" cancel "$filler" 2>>"$DIR/submit.log" || fail "$filler is $(value "$filler" state)"
"$BIN/hslt-job" fetch "$id" -o "$DIR/elastic.exr" || fail "no image of $id"
same "$DIR/long.exr" "$DIR/elastic.exr"

# Three workers were lost: one was told to leave, one was preempted, and one was given up by Slurm but went on. For each
# of them at most one epoch of a chain is computed again; how many epochs are given to two workers at once, because one
# takes long, depends on the machine's load.
grep 'event=lease_granted job=j1 ' "$DIR/coordinator.log" | sed 's/.*peer=[0-9]* //' |
	awk '{ if (seen[$1, $2, $3, $4]++) sum++ } END { print NR, sum + 0 }' >"$DIR/repeats"
read -r leases repeats <"$DIR/repeats"
[ "$leases" -gt 1000 ] && [ "$repeats" -ge 1 ] || fail "$leases leases, $repeats repeated: this tests nothing"
read -r _ _ _ most <<TEXT
$(awk -v job=j1 -f "$HERE/faults/count.awk" "$DIR/coordinator.log")
TEXT
[ "$most" -le 1 ] || fail "$most epochs of a chain were computed again for one worker that was lost"
grep -c 'event=batch_merged job=j1 ' "$DIR/coordinator.log" >"$DIR/merged"
[ "$(grep 'event=batch_merged job=j1 ' "$DIR/coordinator.log" | sed 's/.*peer=[0-9]* //' | sort -u | wc -l)" = "$(cat "$DIR/merged")" ] ||
	fail "an epoch was counted twice"
grep -q 'event=peer_hello.*certificate=worker' "$DIR/coordinator.log" || fail "it was not over TLS"

slurmd -N "$node"
scontrol update NodeName="$node" State=RESUME 2>/dev/null || :
# No signal is sent to the workers: they exit because there is no work.
until_true 20 idle 3 || fail "the cluster does not come to rest: $(sinfo; squeue)"
until_true 10 has_workers 0 || fail "workers are left: $(workers)"
for id in "${first}_1" "${second}_3"; do
	until_true 20 is_job "$id" COMPLETED || fail "the idle worker is $(job_state "$id")"
done

# ---- a whole farm in a job ----

# farm_port JOB.RESTART: prints the port of that start's coordinator
farm_port() {
	cat "$DIR/hslt-farm-$1".*/port 2>/dev/null
}

running() {
	farm_port "$1" >/dev/null &&
		"$BIN/hslt-job" --coordinator "127.0.0.1:$(farm_port "$1")" list 2>/dev/null | grep -q running
}

# Prints the batch job's state, and its output.
told() {
	echo "$(job_state "$JOB")"
	cat "$DIR/$JOB.log"
}

mkdir "$DIR/shared"
batch --nodes=3 --export="ALL,HSLT_SPOOL=$DIR/shared" "$DEPLOY/slurm/farm.sbatch" "$BOX" -o "$DIR/farm.exr" $SHORT
until_true 20 running "$JOB.0" || fail "the farm does not run: $(squeue; told)"
# Between the two starts another process holds the spool, until the second start has run for a second.
flock "$DIR/shared/hslt-farm-$JOB/lock" sh -c "while [ ! -e '$DIR/spool-free' ]; do sleep 0.1; done" &
PIDS="$PIDS $!"
scontrol requeue "$JOB"
requeued "$JOB" || fail "the farm that was requeued is $(told)"
sleep 1
touch "$DIR/spool-free"
until_true 60 is_job "$JOB" COMPLETED || fail "the farm is $(told)"
[ "$(job_field "$JOB" Restarts)" = 1 ] || fail "the farm was not requeued"
[ "$(grep -c 'event=peer_hello.*@n[123]' "$DIR/$JOB.log")" -ge 3 ] || fail "not all nodes worked"
[ "$(grep -c "name=\"$JOB.1@.*ended the connection" "$DIR/$JOB.log")" = 3 ] || fail "workers were not left to leave"
grep -q 'continues from an earlier start' "$DIR/$JOB.log" || fail "the farm began anew"
[ -z "$(ls "$DIR/shared")" ] || fail "it left $(ls "$DIR/shared")"
grep -q 'event=listen.*tls=yes' "$DIR/$JOB.log" || fail "it was not over TLS"
grep -q 'event=peer_hello.*certificate=worker' "$DIR/$JOB.log" || fail "the workers had another certificate"
same "$DIR/short.exr" "$DIR/farm.exr"

batch --nodes=2 "$DEPLOY/slurm/farm.sbatch" "$BOX" -o "$DIR/cut.exr" $LONG
until_true 20 running "$JOB.0" || fail "the farm does not run: $(squeue; told)"
until_true 20 sh -c "'$BIN/hslt-job' --coordinator 127.0.0.1:$(farm_port "$JOB.0") fetch j1 --preview -o '$DIR/look.exr' 2>'$DIR/look.err'" ||
	fail "no preview"
scancel --signal=TERM "$JOB"
until_true 30 is_job "$JOB" FAILED || fail "the farm that was cut short is $(told)"
[ "$(job_field "$JOB" ExitCode)" = 143:0 ] || fail "it ended with $(job_field "$JOB" ExitCode)"
[ -s "$DIR/cut.partial.exr" ] && [ ! -e "$DIR/cut.exr" ] || fail "it left $(ls "$DIR"/cut*)"
until_true 10 idle 3 || fail "it left somebody: $(squeue)"
ls -d "$DIR"/hslt-farm-* 2>/dev/null && fail "it left its folder"

# A preempted job's programs are told to leave one by one; if hslt-submit gets the signal before the script does, the
# image is not lost.
batch --nodes=1 --export="ALL,HSLT_SPOOL=$DIR/shared" "$DEPLOY/slurm/farm.sbatch" "$BOX" -o "$DIR/cut.exr" $LONG
until_true 20 running "$JOB.0" || fail "the farm does not run: $(squeue; told)"
for p in $(ours); do
	[ "$(cat "/proc/$p/comm" 2>/dev/null)" != hslt-submit ] || kill -TERM "$p"
done
until_true 30 is_job "$JOB" FAILED || fail "the farm without its hslt-submit is $(told)"
[ "$(job_field "$JOB" ExitCode)" = 143:0 ] || fail "it ended with $(job_field "$JOB" ExitCode)"
[ -s "$DIR/shared/hslt-farm-$JOB/jobs.db" ] || fail "the image's next start has nothing to continue from: $(told)"
echo "Slurm: from 1 to 3 workers, one told to leave, one preempted, one off a dead node: $repeats of $leases leases were given twice, at most" \
	"$most of a chain; farms requeued and cut short; equal bits"
