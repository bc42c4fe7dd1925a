# SPDX-License-Identifier: Apache-2.0
# A worker spoils the chain states of each result (flipped bits, numbers that are none, noise, truncated states), among
# honest workers that resume from them: no honest worker exits or is quarantined, the faulty one is, its results are
# computed again, and each job has the bits of hslt-render. SEEDS="1 2 ..." (1): two jobs each; make test-states has 50.
. "$(dirname "$0")/lib.sh"
need hslt-coordinator hslt-worker hslt-submit hslt-status hslt-render hslt-job hslt-compare

JOB="--size 64x64 --bootstrap 5000 --mutations 128000 --chains 64 --epoch 250 --groups 8"

honest() {
	for p in $honest; do
		kill -0 "$p" 2>/dev/null || fail "an honest worker has ended"
	done
	"$BIN/hslt-status" >"$DIR/shown"
	for n in honest1 honest2 honest3; do
		! grep -q "quarantined: $n" "$DIR/shown" || fail "$n is quarantined: $(cat "$DIR/shown")"
	done
}

start_coordinator
honest=
for n in 1 2 3; do
	start_worker honest$n
	honest="$honest $WORKER"
done
again=0
for seed in ${SEEDS:-1}; do
	for integrator in hslt pssmlt; do
		start_faulty_worker liar-$seed-$integrator spoil=1 --cache "$DIR/liar-$seed-$integrator"
		liar=$WORKER
		until_true 10 grep -q "event=peer_hello.*name=\"liar-$seed-$integrator\"" "$DIR/coordinator.log" || fail "the liar does not come"
		id=$(submit "$BOX" -o "$DIR/all.exr" $JOB --integrator $integrator --seed $seed)
		"$BIN/hslt-render" "$BOX" -o "$DIR/alone.exr" $JOB --integrator $integrator --seed $seed 2>"$DIR/render.log"
		until_true 120 is_state "$id" done || fail "$id is $(value "$id" state): $(value "$id" why)"
		honest
		again=$((again + $(grep -c "job=$id .*is computed again: its chain states" "$DIR/coordinator.log" || :)))
		"$BIN/hslt-job" fetch "$id" -o "$DIR/farm.exr"
		same "$DIR/alone.exr" "$DIR/farm.exr"
		[ -z "$(value "$id" note | grep anew)" ] || fail "$id lost states: $(value "$id" note)"
		stop $liar
	done
done
grep -q 'event=lease_failed .*states_of="liar-.*refused_by="honest' "$DIR/coordinator.log" || fail "the log does not say whose states were refused"
grep -q 'is computed again: its chain states, made by liar-.*, were refused by honest' "$DIR/coordinator.log" || fail "the log does not say who refused them"
[ "$again" -gt 0 ] || fail "nobody noticed that states were spoiled"
grep -q 'quarantined: liar' "$DIR/shown" || fail "the liar is trusted: $(cat "$DIR/shown")"
echo "$again epochs computed again, no honest worker ended or quarantined, bits of hslt-render"
