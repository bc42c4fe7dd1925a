# SPDX-License-Identifier: Apache-2.0
# What people do to a job, and workers that lie.

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
	"$BIN/hslt-job" hold "$ID" 2>>"$DIR/hold.log" || fail "$NAME: $(tail -n 1 "$DIR/hold.log")"
	"$BIN/hslt-job" release "$ID" 2>>"$DIR/hold.log" || fail "$NAME: $(tail -n 1 "$DIR/hold.log")"
}

fault liar 1 1 "a worker returns wrong results, and every lease is verified"
liar() {
	export HSLT_TEST=1
	farm
	worker w0
	worker w1
	worker w2 --test-lie 2
	job --verify 100%
	finish_job
	[ "$(value "$ID" mismatched)" -gt 0 ] || fail "$NAME: nobody has lied"
	blameless
	unset HSLT_TEST
}

fault spoiled_states 5 1 "a worker returns wrong results and spoils their chain states: who goes on from these finds out, nothing is verified"
spoiled_states() {
	export HSLT_TEST=1
	farm
	worker w0
	job
	while_chains_go_on somebody_spoils
	worker w1
	worker w2
	finish_job
	taken_back
	unset HSLT_TEST
}
# after the bootstrap, and long before the last epochs: nobody goes on from those
while_chains_go_on() {
	i=0
	while [ $i -lt "$TIMES" ]; do
		i=$((i + 1))
		until_true 60 is_merged $((RESULTS * (2 + i) / (2 * (TIMES + 3)))) || fail "$NAME: $(merged) of $RESULTS results at time $i"
		"$@"
	done
}
somebody_spoils() {
	"$BIN/hslt-job" hold "$ID" 2>>"$DIR/hold.log" || fail "$NAME: $(tail -n 1 "$DIR/hold.log")"
	worker "liar$i" --cache "$DIR/cache$i" --test-spoil-states 1 --test-lie 1 --test-hang 3 # of no life of another
	says coordinator "event=peer_hello .*name=\"liar$i\""
	"$BIN/hslt-job" release "$ID" 2>>"$DIR/hold.log" || fail "$NAME: $(tail -n 1 "$DIR/hold.log")"
	says "liar$i" 'event=batch_acknowledged .*kind=2'
	kill -9 "$WORKER"
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
	export HSLT_TEST=1
	# shellcheck disable=SC2086
	farm $CHECKPOINTS
	worker w0
	job
	while_chains_go_on spoils_before_a_restart
	worker w1
	worker w2
	finish_job
	taken_back
	unset HSLT_TEST
}
spoils_before_a_restart() {
	somebody_spoils
	kill -9 "$COORDINATOR_PID"
	# shellcheck disable=SC2086
	again $CHECKPOINTS
}

fault spoiled_checkpoint 5 1 "the same, with checkpoints that take the last results along"
spoiled_checkpoint() {
	CHECKPOINTS="--journal 5"
	spoiled_restart
	grep -q 'event=checkpoint ' "$DIR/coordinator.log" || fail "$NAME: never a checkpoint"
	CHECKPOINTS=
}

fault large_pixel 1 1 "a worker sends results with a pixel of 1e30: they are refused, and it is set aside"
large_pixel() {
	export HSLT_TEST=1
	farm
	worker w0
	worker w1
	worker w2 --test-large 1
	until_true 30 grep -q 'event=peer_hello.*name="w2"' "$DIR/coordinator.log" || fail "$NAME: w2 does not come"
	job
	finish_job
	[ "$(grep -c 'event=batch_refused .*worker="w2" ' "$DIR/coordinator.log")" -ge 3 ] || fail "$NAME: it is not named"
	! grep 'event=batch_refused' "$DIR/coordinator.log" | grep -v 'worker="w2"' || fail "$NAME: others are refused"
	"$BIN/hslt-status" | grep -q '^w2 .* aside ' || fail "$NAME: $("$BIN/hslt-status")"
	blameless
	unset HSLT_TEST
}
