/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Jobs restored after a restart of the coordinator, as transcripts: in the bootstrap, in the middle of a round, with
 * stored results, at a bound that was already met, on hold, and more jobs than may run at once. A result that was
 * merged before the restart is a repeat; a lease from before the restart is accepted when its result arrives.
 */
#include "coordinator/core/doubt.h"
#include "tests/support/transcript.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

static void job_is_restored_during_its_bootstrap(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] restore j4 boot 1,0 fingerprint=A elapsed=3 -> -",
		"[0] w1 joins B threads=1 -> -",
		"[0] w1 wants 1 -> -", /* the job is pinned to fingerprint A */
		"[0] w2 joins A threads=1 -> -",
		"[0] w2 wants 1 -> w2 gets j4 g1 p0 boot",
		"[1] w2 batch j4 g0 p0 boot -> repeat: merged already",
		"[1] w2 batch j4 g1 p0 boot -> merge, merged, j4 prepare",
		"[1] prepared j4 -> j4 is running, w2 gets j4 g0 p0 e0",
		NULL,
	});
}

/* Two rounds are open as before: merged results are repeats, and results of leases that were out count when they
 * arrive, whether the lease was handed out again or not. */
static void job_is_restored_within_a_round(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(
		f, (const char *const[]){
			   "[0] restore j7 render 4,3,5 fingerprint=A elapsed=10 groups=3 rounds=9 -> j7 is running",
			   "[0] w1 joins A threads=1 -> -",
			   "[0] w1 batch j7 g0 p0 e3 -> repeat: merged already",
			   "[0] w1 batch j7 g2 p0 e5 -> refused: the epoch is not open",
			   "[0] w1 wants 1 -> w1 gets j7 g1 p0 e3",
			   "[1] w1 batch j7 g0 p0 e4 -> merge, merged",
			   "[1] w1 batch j7 g0 p0 e5 -> refused: the epoch is not open",
			   "[2] w1 batch j7 g1 p0 e3 -> merge, merged, j7 round 4, w1 gets j7 g1 p0 e4",
			   "[3] w1 batch j7 g1 p0 e4 -> merge, merged, j7 round 5, w1 gets j7 g2 p0 e5",
			   /* ids continue */
			   "[3] submit -> j8 submitted, j8 is queued",
			   NULL,
		   });
	struct job_status s;
	assert_true(farm_job_status(f, 7, 3, &s));
	assert_int_equal(s.leases_merged, 4 + 3 + 5 + 3);
	assert_int_equal(s.bootstrap_merged, 3);
	assert_true(s.rounds == 5 && s.started_at == -10);
	assert_true(farm_job_elapsed(f, 7, 3) == 13);
	farm_free(f);
}

/* A result stored before the restart waits for an earlier epoch: it counts once that epoch is merged, and only the
 * worker that holds its lease is told. */
static void stored_result_counts_once_its_earlier_epoch_is_merged(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] restore j7 render 0,1,0 fingerprint=A elapsed=10 groups=3 rounds=9 -> j7 is running",
		"[0] w1 joins A threads=2 -> -",
		"[0] w1 stored j7 g0 p0 e1 -> -",
		"[0] w1 stored j7 g1 p0 e0 -> -",
		"[0] w1 stored j7 g1 p0 e2 -> -", /* too early, already merged, or not open */
		"[0] w1 wants 2 -> w1 gets j7 g0 p0 e0, w1 gets j7 g2 p0 e0",
		"[1] w1 batch j7 g0 p0 e0 -> merge, merged, w1 gets j7 g1 p0 e1",
		"[1] w1 stored j7 g0 p0 e1 -> merge",
		"[1] w1 stored j7 g0 p0 e1 -> -",
		"[1] w1 stored j7 g1 p0 e1 -> merge, w1 loses j7 g1 p0 e1",
		"[2] w1 stored j7 g2 p0 e0 -> merge, w1 loses j7 g2 p0 e0, j7 round 1, w1 gets j7 g2 p0 e1, w1 gets j7 g0 p0 e2",
		"[3] cancel j7 -> j7 cancelled, w1 loses j7 g0 p0 e2, w1 loses j7 g2 p0 e1, j7 is cancelled (cancelled: cancelled)",
		"[3] w1 stored j7 g2 p0 e1 -> -",
		NULL,
	});
}

static void job_is_restored_before_its_first_lease(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   "[0] restore j1 boot 0,0 -> -",
				   "[0] restore j3 boot 0,0 priority=5 -> -",
				   "[0] w1 joins B threads=1 -> -",
				   "[0] w1 wants 1 -> j3 is bootstrap, w1 gets j3 g0 p0 boot",
				   NULL,
			   });
	struct job_status s;
	assert_true(farm_job_status(f, 1, 3, &s));
	assert_int_equal(s.state, JOB_QUEUED);
	farm_free(f);
}

/* Bounds that were met at the last complete round are still met after the restart: the number of rounds, the error, and
 * the time as of that round rather than the time used since. */
static void bounds_that_were_met_stay_met(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] restore j1 render 2,2 elapsed=3 completed=3 rounds=2 -> "
		"j1 is running, j1 publish 2, j1 is done (mutations)",
		NULL,
	});
	transcript_check((const char *const[]){
		"[0] restore j1 render 2,3 elapsed=3 completed=3 rounds=9 target=0.1 -> j1 is running, j1 evaluate 2",
		"[1] w1 joins A threads=1 -> -",
		"[1] w1 wants 1 -> w1 gets j1 g0 p0 e2",
		"[2] w1 batch j1 g0 p0 e2 -> refused: the job's error is being estimated, w1 gets j1 g0 p0 e2",
		"[2] error j1 2 0.05 -> w1 loses j1 g0 p0 e2, j1 publish 2, j1 is done (error)",
		NULL,
	});
	transcript_check((const char *const[]){
		"[100] restore j1 render 2,3 elapsed=9 completed=7 rounds=inf seconds=8 -> j1 is running",
		"[100] w1 joins A threads=1 -> -",
		"[100] w1 batch j1 g0 p0 e2 -> merge, merged, j1 round 3, j1 publish 3, j1 is done (time)",
		NULL,
	});
	transcript_check((const char *const[]){
		"[100] restore j1 render 2,3 elapsed=9 completed=8 rounds=inf seconds=8 -> "
		"j1 is running, j1 publish 2, j1 is done (time)",
		NULL,
	});
	transcript_check((const char *const[]){
		"[0] restore j1 render 0,0 elapsed=3 black -> j1 publish 0, j1 is done (black: no bootstrap sample carried light)",
		NULL});
}

static void a_job_on_hold_gets_no_leases(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   "[0] submit -> j1 submitted, j1 is queued",
				   "[0] w1 joins A threads=2 -> -",
				   "[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
				   "[1] hold j1 no room -> -",
				   "[1] w1 wants 2 -> -",
				   "[1] w1 batch j1 g0 p0 boot -> merge, merged",
				   NULL,
			   });
	struct job_status s;
	assert_true(farm_job_status(f, 1, 1, &s));
	assert_int_equal(s.state, JOB_HELD);
	assert_string_equal(s.waiting, "no room");
	transcript_play(
		f,
		(const char *const[]){
			"[2] release j1 -> w1 gets j1 g1 p0 boot",
			"[3] hold j1 no room -> -",
			"[4] cancel j1 -> j1 cancelled, w1 loses j1 g1 p0 boot, j1 is cancelled (cancelled: cancelled)",
			NULL,
		});
	assert_true(farm_job_status(f, 1, 5, &s));
	assert_int_equal(s.state, JOB_CANCELLED);
	farm_free(f);
}

/* All jobs from before the restart run, and no new job starts before their number is below the limit. */
static void restored_jobs_may_exceed_the_limit(void **state)
{
	(void)state;
	enum { JOBS = 30 };
	struct farm_config c;
	struct farm *f;
	struct job_status s;
	farm_config_init(&c);
	c.max_jobs = 2;
	c.max_ended_jobs = 1;
	c.max_peers = 1;
	assert_int_equal(farm_new(&f, &c, NULL), 0);
	for (int i = 1; i <= JOBS; i++) {
		char line[64];
		snprintf(line, sizeof line, "[0] restore j%d boot 0,0 -> -", i);
		transcript_play(f, (const char *const[]){line, NULL});
	}
	for (int i = 1; i <= JOBS; i++)
		assert_true(farm_job_status(f, (uint64_t)i, 0, &s) && s.state == JOB_QUEUED);
	for (int i = 1; i < JOBS; i++) {
		char line[128], forgotten[32] = "";
		if (i > 1)
			snprintf(forgotten, sizeof forgotten, ", j%d forgotten", i - 1);
		snprintf(line, sizeof line,
			 "[%d] cancel j%d -> j%d cancelled, j%d is cancelled (cancelled: cancelled)%s", i, i, i, i,
			 forgotten);
		transcript_play(
			f,
			(const char *const[]){
				"[0] submit -> rejected: the coordinator has as many live jobs as it accepts",
				"[0] restore asked j99 boot 0,0 -> rejected: the coordinator has as many live jobs as it accepts",
				line, NULL});
	}
	transcript_play(f, (const char *const[]){
				   "[40] submit -> j31 submitted, j31 is queued",
				   "[41] submit -> rejected: the coordinator has as many live jobs as it accepts",
				   NULL,
			   });
	farm_free(f);
}

/* An extended job brings back what its workers had reported: for connected workers the present report stays, for others
 * the latest report counts. */
static void reports_of_workers_are_restored_with_a_job(void **state)
{
	(void)state;
	const struct plan plan = {.kind = PLAN_CHAINS,
				  .width = 8,
				  .height = 8,
				  .crop_width = 8,
				  .crop_height = 8,
				  .groups = 3,
				  .parts = 1,
				  .chains = 12,
				  .rounds = 9,
				  .epoch = 100,
				  .bootstrap = 1000};
	const uint64_t next[3] = {2, 2, 2};
	const struct event_join by[3] = {{.name = "old", .certificate = "", .home = "a", .restarts = 2},
					 {.name = "two", .certificate = "", .home = "b", .restarts = 7},
					 {.name = "two", .certificate = "", .home = "b", .restarts = 6}};
	const struct forecast_history looks = {.count = 0};
	struct farm *f = transcript_farm_new();
	struct peer_status p;
	struct worker_status w;
	struct update u;
	transcript_play(f, (const char *const[]){"[0] w1 joins A threads=1 name=c home=a start=5 -> -", NULL});
	struct event ev = {.kind = EVENT_RESTORE,
			   .restore = {.job = 3,
				       .submit = {.plan = &plan, .name = "job", .owner = ""},
				       .fingerprint = "A",
				       .kind = LEASE_RENDER,
				       .next_epochs = next,
				       .makers = by,
				       .elapsed = 1,
				       .first_round_at = 0,
				       .last_round_end = 1,
				       .looks = &looks}};
	farm_step(f, &ev, &u);
	assert_true(farm_peer_status(f, 1, &p) && farm_worker_status(f, p.worker_id, &w));
	assert_int_equal(w.restarts, 5);
	assert_string_equal(w.name, "c");
	assert_string_equal(doubt_maker_name(f, &(struct lease_key){3, LEASE_RENDER, 0, 0, 2}), "c");
	assert_string_equal(doubt_maker_name(f, &(struct lease_key){3, LEASE_RENDER, 1, 0, 2}), "two");
	assert_true(farm_worker_status(f, p.worker_id + 1, &w));
	assert_int_equal(w.restarts, 7);
	transcript_play(f, (const char *const[]){
				   "[1] w1 leaves -> -",
				   "[2] w2 joins A threads=1 name=c home=a start=4 -> rejected: this is start 4 of c, "
				   "and its start 5 has connected before",
				   NULL});
	farm_free(f);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(job_is_restored_during_its_bootstrap),
		cmocka_unit_test(job_is_restored_within_a_round),
		cmocka_unit_test(stored_result_counts_once_its_earlier_epoch_is_merged),
		cmocka_unit_test(job_is_restored_before_its_first_lease),
		cmocka_unit_test(bounds_that_were_met_stay_met),
		cmocka_unit_test(a_job_on_hold_gets_no_leases),
		cmocka_unit_test(restored_jobs_may_exceed_the_limit),
		cmocka_unit_test(reports_of_workers_are_restored_with_a_job),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
