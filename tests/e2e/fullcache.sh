# SPDX-License-Identifier: Apache-2.0
# Three workers connect whose caches are on a full disk, before any other worker: this fails no job. The job waits, its
# status names these workers, and the first worker that has room renders it.
OWN_MOUNTS=needed
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-job

mkdir "$DIR/disk"
mount -t tmpfs -o size=256k none "$DIR/disk" || skip "no tmpfs"
start_coordinator
for n in 1 2 3; do
	start_worker bad$n --cache "$DIR/disk/$n"
	until_true 10 grep -qs event=connect "$DIR/bad$n.log" || fail "bad$n does not connect"
done
head -c 1000000 /dev/zero >"$DIR/disk/filler" 2>/dev/null && fail "there is room"

is_waiting() {
	is_state "$1" failed || value "$1" waiting | grep -q 'no worker can compute it'
}
id=$(submit "$BOX" -o "$DIR/box.exr" --integrator path --spp 4)
until_true 20 is_waiting "$id" || fail "$id is $(value "$id" state), $(value "$id" waiting)"
is_state "$id" failed && fail "$id failed: $(value "$id" why)"
"$BIN/hslt-status" --json "$id" | grep -q '"waiting":"no worker can compute it, because of a problem on the machines of bad1, bad2, bad3; the last one: bad[123]: .*No space left' ||
	fail "it waits for: $("$BIN/hslt-status" --json "$id" | grep -o '"waiting":"[^"]*')"
"$BIN/hslt-job" log "$id" | grep -q 'event=lease_failed worker="bad[123]" own=1 .*No space left' || fail "the log does not say why"
start_worker good
until_true 20 is_state "$id" done || fail "$id is $(value "$id" state), $(value "$id" waiting)"
echo "three full disks end no job, and a fourth worker renders it"
