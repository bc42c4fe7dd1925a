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
