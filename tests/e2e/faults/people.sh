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
