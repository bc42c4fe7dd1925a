# SPDX-License-Identifier: Apache-2.0
# What users do to a job, and workers that return wrong results.

fault held 10 1 "the job is held, and released"
held() {
	farm
	worker w0
	worker w1
	job
	each_time somebody_holds
	finish_job
}
somebody_holds() {
	hold_job
	release_job
}

fault liar 1 1 "a worker returns wrong results, and every lease is verified"
liar() {
	farm
	worker w0
	worker w1
	faulty_worker w2 lie=2
	says w2 event=connect\ 
	job --verify 100%
	finish_job
	[ "$(value "$ID" mismatched)" -gt 0 ] || fail "$NAME: nobody has lied"
	blameless
}

fault spoiled_states 5 1 "a worker returns wrong results with corrupt chain states, without verification: whoever resumes from them notices"
spoiled_states() {
	farm
	worker w0
	OTHER=$WORKER
	job
	while_chains_go_on somebody_spoils
	worker w1
	worker w2
	finish_job
	taken_back
}
# after the bootstrap, and long before the last epochs, from which no lease continues
while_chains_go_on() {
	i=0
	while [ $i -lt "$TIMES" ]; do
		i=$((i + 1))
		until_true 60 is_merged $((RESULTS * (2 + i) / (2 * (TIMES + 3)))) || fail "$NAME: $(merged) of $RESULTS results at time $i"
		"$@"
	done
}
# The other worker is stopped meanwhile, so that more than the last epochs is left.
somebody_spoils() {
	hold_job $((RESULTS / 4)) $((RESULTS * 3 / 4))
	faulty_worker "liar$i" spoil=1,lie=1,hang=3 --cache "$DIR/cache$i" # a cache of its own, or it would count as another start of the same worker
	says coordinator "event=peer_hello .*name=\"liar$i\""
	stand_still "$OTHER"
	release_job
	says "liar$i" 'event=batch_acknowledged .*kind=render'
	kill -9 "$WORKER"
	go_on "$OTHER"
}
taken_back() {
	grep -q "event=batch_taken_back job=$ID .*made by liar" "$DIR/coordinator.log" || fail "$NAME: no result of a liar is taken back"
	! grep -q "event=batch_taken_back job=$ID .*made by w" "$DIR/coordinator.log" || fail "$NAME: a result of an honest worker is taken back"
	! grep -q 'event=worker_wrong .*worker="w' "$DIR/coordinator.log" || fail "$NAME: an honest worker is blamed"
	! value "$ID" note | grep -q anew || fail "$NAME: $(value "$ID" note)"
}

CHECKPOINTS=
fault spoiled_restart 5 1 "the same, and the coordinator is killed and started again right after that"
spoiled_restart() {
	# shellcheck disable=SC2086
	farm $CHECKPOINTS
	worker w0
	OTHER=$WORKER
	job
	while_chains_go_on spoils_before_a_restart
	worker w1
	worker w2
	finish_job
	taken_back
}
spoils_before_a_restart() {
	somebody_spoils
	kill -9 "$COORDINATOR_PID"
	# shellcheck disable=SC2086
	again $CHECKPOINTS
}

fault spoiled_checkpoint 5 1 "the same, with checkpoints that already contain the last results"
spoiled_checkpoint() {
	CHECKPOINTS="--journal 5"
	spoiled_restart
	grep -q 'event=checkpoint ' "$DIR/coordinator.log" || fail "$NAME: never a checkpoint"
	CHECKPOINTS=
}

fault large_pixel 1 1 "a worker sends results with a pixel of 1e30: they are refused, and it is quarantined"
large_pixel() {
	farm
	faulty_worker w2 large=1
	says coordinator 'event=peer_hello.*name="w2"'
	job
	until_true 30 has_said coordinator 'event=batch_refused .*worker="w2" ' 3 || fail "$NAME: it is not named"
	worker w0
	worker w1
	finish_job
	! grep 'event=batch_refused' "$DIR/coordinator.log" | grep -v 'worker="w2"\|text="the job is over"' || fail "$NAME: others are refused"
	"$BIN/hslt-status" | grep -q '^w2 .* quarantined ' || fail "$NAME: $("$BIN/hslt-status")"
	blameless
}

fault targets 4 4 "an image is fetched into a FIFO, a device, a symbolic link, an open descriptor: none of them is replaced"
targets() {
	[ -n "${HSLT_OWN_MOUNTS:-}" ] || { cannot "no name spaces for mounts here" && return 0; }
	farm
	worker w0
	worker w1
	job
	each_time fetches_preview_into
	finish_job
	for i in 1 2 3 4; do
		fetches_into fetch "$ID"
		[ $i -eq 2 ] || same "$QUIET" "$DIR/real.exr"
	done
}
# Before the first round is complete there is no preview.
fetches_preview_into() {
	until_true 30 has_round || fail "$NAME: no round of $ID is complete"
	fetches_into fetch --preview "$ID"
}
has_round() {
	[ "$(value "$ID" rounds)" -gt 0 ] 2>/dev/null
}
# fetches_into ARGUMENT...: fetches the image with hslt-job to the I-th kind of target; what the target passes on is in
# real.exr, except for the device, which drops it (and, being a mount, could not be replaced anyway)
fetches_into() {
	rm -f "$DIR/target.exr" "$DIR/real.exr"
	case $i in
	1)
		mkfifo "$DIR/target.exr"
		cat "$DIR/target.exr" >"$DIR/real.exr" &
		PIDS="$PIDS $!" # without a writer it would wait for ever
		code 0 timeout 100 "$BIN/hslt-job" "$@" -o "$DIR/target.exr"
		[ -p "$DIR/target.exr" ] || fail "$NAME: the FIFO is replaced"
		wait $!
		;;
	2)
		: >"$DIR/target.exr"
		mount --bind /dev/null "$DIR/target.exr"
		got=0
		timeout 100 "$BIN/hslt-job" "$@" -o "$DIR/target.exr" 2>"$DIR/err.log" || got=$?
		umount "$DIR/target.exr"
		[ $got -eq 0 ] && [ ! -s "$DIR/target.exr" ] || fail "$NAME: a device: $got, $(cat "$DIR/err.log")"
		return 0
		;;
	3)
		: >"$DIR/real.exr"
		ln -s real.exr "$DIR/target.exr"
		code 0 timeout 100 "$BIN/hslt-job" "$@" -o "$DIR/target.exr"
		[ -L "$DIR/target.exr" ] || fail "$NAME: the link is replaced"
		;;
	4)
		ln -s /dev/stdout "$DIR/target.exr"
		code 0 timeout 100 "$BIN/hslt-job" "$@" -o "$DIR/target.exr"
		[ -L "$DIR/target.exr" ] && [ -L /dev/stdout ] || fail "$NAME: the link is replaced"
		mv "$DIR/out" "$DIR/real.exr"
		;;
	esac
	[ "$(od -An -tx1 -N4 "$DIR/real.exr" | tr -d ' ')" = 762f3101 ] || fail "$NAME: no image comes out of kind $i"
}

fault other_role 3 1 "a worker connects with a client's certificate: it is told why, and exits"
other_role() {
	export HSLT_CA="$DIR/ca"
	for who in init "worker node" "client ann"; do
		# shellcheck disable=SC2086
		"$BIN/hslt-ca" $who >>"$DIR/ca.log" 2>&1 || fail "$NAME: $(tail -n 1 "$DIR/ca.log")"
	done
	farm --tls "$DIR/ca/coordinator"
	worker w0 --tls "$DIR/ca/node"
	worker w1 --tls "$DIR/ca/node"
	export HSLT_TLS="$DIR/ca/ann"
	job
	each_time a_client_leases
	finish_job
	blameless
	unset HSLT_TLS HSLT_CA
}
a_client_leases() {
	code 6 timeout 100 "$BIN/hslt-worker" --threads 1 --name "client$i" --cache "$DIR/cache"
	grep -q 'cannot take leases' "$DIR/err.log" || fail "$NAME: it says $(cat "$DIR/err.log")"
}

fault large_picture 3 1 "a scene with a PNG of 140 KB and 16,000 x 16,000 pixels is submitted, also without hslt-submit's checks"
large_picture() {
	cp -r "$HERE/../scenes/box" "$DIR/large"
	sed '/id="white"/s|<rgb.*/>|<texture name="reflectance" type="bitmap"><string name="filename" value="large.png"/></texture>|' "$BOX" >"$DIR/large/box.xml"
	farm
	worker w0
	worker w1
	job
	each_time somebody_sends_it
	finish_job
	blameless
	! grep -q event=process_lost "$DIR"/w?.log || fail "$NAME: a process was lost"
	[ "$(peak)" -lt 262144 ] || fail "$NAME: a worker took $(peak) KB"
}
somebody_sends_it() {
	"$PYTHON" "$HERE/faults/picture.py" "${COORDINATOR#*:}" "$DIR/large" >"$DIR/picture.log" 2>&1 || fail "$NAME: $(cat "$DIR/picture.log")"
	code 1 timeout 100 "$BIN/hslt-submit" "$DIR/large/box.xml" -o "$DIR/no.exr" --spp 1
	grep -q 'box.xml:[0-9]*: .*large.png: 16000 x 16000 pixels; at most' "$DIR/err.log" || fail "$NAME: hslt-submit says $(cat "$DIR/err.log")"
	other=j$((${ID#j} + i))
	until_true 60 is_state "$other" failed || fail "$NAME: $other is $(value "$other" state)"
	"$BIN/hslt-job" log "$other" 2>&1 | grep -q 'large.png: 16000 x 16000 pixels; at most' || fail "$NAME: $("$BIN/hslt-job" log "$other" 2>&1)"
}
# Prints the peak memory of a worker's process, in KB.
peak() {
	awk '/^VmHWM/ { print $2 }' "/proc/$(renders "$WORKER")/status"
}
