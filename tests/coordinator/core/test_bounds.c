/* SPDX-License-Identifier: Apache-2.0 */
/*
 * How a job ends, as transcripts of events and actions: at its number of samples, its time limit or its target error,
 * without any light, or by failing; the exit code of each end is checked. Also what the job's status says meanwhile:
 * progress, rate, remaining time and forecast.
 */
#include "tests/support/transcript.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

/* One worker with one slot: the leases follow each other. */
/* clang-format off */
#define START(options)                                                 \
	"[0] submit groups=1 " options " -> j1 submitted, j1 is queued", \
	"[0] w1 joins A threads=1 -> -",                               \
	"[10] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",   \
	"[11] w1 batch j1 g0 p0 boot -> merge, merged, j1 prepare"
/* clang-format on */

static void expect_end(struct farm *f, enum job_state state, enum job_end end, int code)
{
	struct job_status s;
	assert_true(farm_job_status(f, 1, 1000, &s));
	assert_int_equal(s.state, state);
	assert_int_equal(s.end, end);
	assert_int_equal(job_exit_code(&s), code);
	if (state == JOB_DONE)
		assert_true(s.progress == 1);
	farm_free(f);
}

static void job_ends_at_its_time_limit(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(
		f, (const char *const[]){
			   START("rounds=inf seconds=5"),
			   "[12] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0",
			   "[14.9] w1 batch j1 g0 p0 e0 -> merge, merged, j1 round 1, w1 gets j1 g0 p0 e1",
			   /* The time limit is checked when a round is complete; the time runs from the first bootstrap
			    * lease. */
			   "[15.5] tick -> -",
			   "[16] w1 batch j1 g0 p0 e1 -> merge, merged, j1 round 2, j1 publish 2, j1 is done (time)",
			   NULL,
		   });
	expect_end(f, JOB_DONE, END_TIME, 0);
}

static void job_ends_at_its_target_error(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(
		f,
		(const char *const[]){
			START("rounds=inf target=0.1"),
			"[12] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0",
			"[13] w1 batch j1 g0 p0 e0 -> merge, merged, j1 round 1, j1 evaluate 1, w1 gets j1 g0 p0 e1",
			/* Results that would change the prefix of rounds whose error is being estimated wait; so does
			 * an estimate of another prefix. */
			"[14] w1 batch j1 g0 p0 e1 -> refused: the job's error is being estimated, w1 gets j1 g0 p0 e1",
			"[14] error j1 2 0.01 -> -",
			"[14] error j1 1 nan -> -",
			"[15] w1 batch j1 g0 p0 e1 -> merge, merged, j1 round 2, j1 evaluate 2, w1 gets j1 g0 p0 e2",
			"[15] error j1 1 0.01 -> -", /* An estimate of an earlier prefix is ignored, however small its
						      * error is. */
			"[15] error j1 2 0.5 -> -",
			"[16] w1 batch j1 g0 p0 e2 -> merge, merged, j1 round 3, j1 evaluate 3, w1 gets j1 g0 p0 e3",
			"[16] error j1 3 0.3 -> -",
			"[17] w1 batch j1 g0 p0 e3 -> merge, merged, j1 round 4, j1 evaluate 4, w1 gets j1 g0 p0 e4",
			"[17] error j1 4 0.2 -> -",
			"[18] w1 batch j1 g0 p0 e4 -> merge, merged, j1 round 5, j1 evaluate 5, w1 gets j1 g0 p0 e5",
			"[18] error j1 5 0.2 -> -",
			"[19] w1 batch j1 g0 p0 e5 -> merge, merged, j1 round 6, j1 evaluate 6, w1 gets j1 g0 p0 e6",
			"[19] error j1 6 0.2 -> -",
			"[20] w1 batch j1 g0 p0 e6 -> merge, merged, j1 round 7, j1 evaluate 7, w1 gets j1 g0 p0 e7",
			"[21] error j1 7 0.1 -> w1 loses j1 g0 p0 e7, j1 publish 7, j1 is done (error)",
			"[22] w1 batch j1 g0 p0 e7 -> refused: the job is over",
			NULL,
		});
	expect_end(f, JOB_DONE, END_ERROR, 0);
}

static void time_limit_ends_a_job_above_its_target(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(
		f, (const char *const[]){
			   "[0] submit groups=2 rounds=7 seconds=3 target=0.1 -> j1 submitted, j1 is queued",
			   "[0] w1 joins A threads=2 -> -",
			   "[0] w1 wants 2 -> j1 is bootstrap, w1 gets j1 g0 p0 boot, w1 gets j1 g1 p0 boot",
			   "[1] w1 batch j1 g0 p0 boot -> merge, merged",
			   "[1] w1 batch j1 g1 p0 boot -> merge, merged, j1 prepare",
			   "[1] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0, w1 gets j1 g1 p0 e0",
			   "[3] w1 batch j1 g0 p0 e0 -> merge, merged, w1 gets j1 g0 p0 e1",
			   /* The job is about to end: nothing more is handed out or merged while its error is evaluated
			    * a last time. */
			   "[4] w1 batch j1 g1 p0 e0 -> merge, merged, j1 round 1, w1 loses j1 g0 p0 e1, j1 evaluate 1",
			   "[4] w1 batch j1 g0 p0 e1 -> refused: the job is ending",
			   "[4] error j1 1 0.4 -> j1 publish 1, j1 is done (time)",
			   NULL,
		   });
	expect_end(f, JOB_DONE, END_TIME, 4);
}

/* The warning that chains disagree is given for every bound that ends a job. The message has no effect before the job's
 * end, after a failure, or on other jobs. */
static void disagreement_of_chains_sets_the_exit_code(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   START("rounds=1 target=0.1"),
				   "[11] image j1 disagrees -> -",
				   "[12] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0",
				   "[13] w1 batch j1 g0 p0 e0 -> merge, merged, j1 round 1, j1 evaluate 1",
				   "[13] error j1 1 0.5 -> j1 publish 1, j1 is done (mutations)",
				   NULL,
			   });
	struct job_status s;
	assert_true(farm_job_status(f, 1, 1000, &s));
	assert_int_equal(job_exit_code(&s), 4);
	transcript_play(f, (const char *const[]){
				   "[14] image j1 disagrees -> -",
				   "[14] image j2 -> -",
				   NULL,
			   });
	expect_end(f, JOB_DONE, END_MUTATIONS, 5);
	f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   START("rounds=1"),
				   "[12] prepared j1 bad no space left -> j1 is failed (failed: no space left)",
				   "[13] image j1 disagrees -> -",
				   NULL,
			   });
	expect_end(f, JOB_FAILED, END_FAILED, 3);
}

static void target_met_by_the_last_round_counts(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   START("rounds=1 target=0.1"),
				   "[12] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0",
				   "[13] w1 batch j1 g0 p0 e0 -> merge, merged, j1 round 1, j1 evaluate 1",
				   "[13] error j1 1 0.05 -> j1 publish 1, j1 is done (error)",
				   NULL,
			   });
	expect_end(f, JOB_DONE, END_ERROR, 0);
}

static void no_light_in_the_bootstrap_ends_the_job(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(
		f,
		(const char *const[]){
			START("rounds=1"),
			"[12] prepared j1 black -> j1 publish 0, j1 is done (black: no bootstrap sample carried light)",
			NULL,
		});
	expect_end(f, JOB_DONE, END_BLACK, 0);
}

/* A round has 8 x 8 pixels of 8,000 samples, so two rounds make a million samples. A job with another bound goes on
 * until then. */
static void black_image_ends_a_job_without_another_bound(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(
		f, (const char *const[]){
			   START("samples rounds=inf target=0.1 epoch=8000"),
			   "[12] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0",
			   "[13] w1 batch j1 g0 p0 e0 -> merge, merged, j1 round 1, j1 evaluate 1, w1 gets j1 g0 p0 e1",
			   "[13] error j1 1 black -> -",
			   "[14] w1 batch j1 g0 p0 e1 -> merge, merged, j1 round 2, j1 evaluate 2, w1 gets j1 g0 p0 e2",
			   "[14] error j1 2 black -> w1 loses j1 g0 p0 e2, j1 publish 2, "
			   "j1 is done (black: no sample carried light)",
			   NULL,
		   });
	expect_end(f, JOB_DONE, END_BLACK, 0);
	f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   START("samples rounds=1 target=0.1 epoch=80000"),
				   "[12] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0",
				   "[13] w1 batch j1 g0 p0 e0 -> merge, merged, j1 round 1, j1 evaluate 1",
				   "[13] error j1 1 black -> j1 publish 1, j1 is done (mutations)",
				   NULL,
			   });
	expect_end(f, JOB_DONE, END_MUTATIONS, 4);
}

static void failed_preparation_fails_the_job(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   START("rounds=1"),
				   "[12] prepared j1 bad no space left -> j1 is failed (failed: no space left)",
				   NULL,
			   });
	expect_end(f, JOB_FAILED, END_FAILED, 3);
}

static void an_overflown_sum_fails_the_job(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(
		f,
		(const char *const[]){
			START("rounds=1"),
			"[12] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0",
			"[13] broken j1 a sum left the grid -> w1 loses j1 g0 p0 e0, j1 is failed (failed: a sum left the grid)",
			NULL,
		});
	expect_end(f, JOB_FAILED, END_FAILED, 3);
}

static struct job_status read_job_status(const struct farm *f, double now)
{
	struct job_status s;
	assert_true(farm_job_status(f, 1, now, &s));
	return s;
}

static void expect_near(double a, double b)
{
	if (!(fabs(a - b) <= 1e-9 * fabs(b)))
		fail_msg("%.17g is not %.17g", a, b);
}

static void progress_and_rate_follow_merged_mutations(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	/* 1000 bootstrap samples and 10 rounds of 400 mutations */
	transcript_play(f, (const char *const[]){
				   START("rounds=10"),
				   "[11] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0",
				   NULL,
			   });
	expect_near(read_job_status(f, 11).progress, 1000.0 / 5000);
	assert_true(isnan(read_job_status(f, 11).eta));
	transcript_play(f, (const char *const[]){
				   "[13] w1 batch j1 g0 p0 e0 -> merge, merged, j1 round 1, w1 gets j1 g0 p0 e1",
				   "[15] w1 batch j1 g0 p0 e1 -> merge, merged, j1 round 2, w1 gets j1 g0 p0 e2",
				   NULL,
			   });
	struct job_status s = read_job_status(f, 15);
	expect_near(s.progress, 1800.0 / 5000);
	expect_near(s.rate, 200);
	expect_near(s.eta, 16);
	assert_int_equal(s.mutations, 800);
	assert_true(s.started_at == 10 && s.submitted_at == 0);
	transcript_play(f, (const char *const[]){"[15] hold order j1 held by ann -> -", NULL});
	s = read_job_status(f, 15);
	assert_true(isnan(s.eta) && isnan(s.eta_low) && isnan(s.eta_high));
	farm_free(f);
}

/* Progress that a job made before other jobs took its workers does not predict its end. */
static void no_eta_without_leases(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   START("rounds=10"),
				   "[11] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0",
				   "[13] w1 batch j1 g0 p0 e0 -> merge, merged, j1 round 1, w1 gets j1 g0 p0 e1",
				   "[15] submit groups=1 priority=5 -> j2 submitted, j2 is queued",
				   NULL,
			   });
	expect_near(read_job_status(f, 15).eta, 36);
	transcript_play(f, (const char *const[]){
				   "[17] w1 batch j1 g0 p0 e1 -> merge, merged, j1 round 2, j2 is bootstrap, "
				   "w1 gets j2 g0 p0 boot",
				   NULL,
			   });
	struct job_status s = read_job_status(f, 17);
	assert_string_equal(s.waiting, "waits for j2 of higher priority (5)");
	assert_true(s.rate > 0 && isnan(s.eta) && isnan(s.eta_low) && isnan(s.eta_high));
	farm_free(f);
	/* The time limit ends the job all the same. */
	f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   START("rounds=10 seconds=100"),
				   "[11] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0",
				   "[13] w1 batch j1 g0 p0 e0 -> merge, merged, j1 round 1, w1 gets j1 g0 p0 e1",
				   "[14] w1 leaves -> -",
				   NULL,
			   });
	s = read_job_status(f, 14);
	assert_string_equal(s.waiting, "no worker is connected");
	expect_near(s.eta, 96);
	farm_free(f);
}

/* Progress in the bootstrap does not predict the end either: a bootstrap may be so short that its rate only measures
 * waiting. */
static void no_eta_during_the_bootstrap(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   "[0] submit groups=2 rounds=10 -> j1 submitted, j1 is queued",
				   "[0] w1 joins A threads=1 -> -",
				   "[0] w1 wants 2 -> j1 is bootstrap, w1 gets j1 g0 p0 boot, w1 gets j1 g1 p0 boot",
				   "[5] w1 batch j1 g0 p0 boot -> merge, merged",
				   NULL,
			   });
	struct job_status s = read_job_status(f, 5);
	assert_true(s.rate > 0 && s.progress > 0 && isnan(s.eta) && isnan(s.eta_low) && isnan(s.eta_high));
	farm_free(f);
}

static void progress_towards_a_target_error_never_falls(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(
		f, (const char *const[]){
			   START("rounds=inf target=0.1"),
			   "[11] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0",
			   "[13] w1 batch j1 g0 p0 e0 -> merge, merged, j1 round 1, j1 evaluate 1, w1 gets j1 g0 p0 e1",
			   "[13] error j1 1 0.2 -> -",
			   NULL,
		   });
	/* Twice the target error needs four rounds; when these turn out to be too few, progress does not fall back. */
	expect_near(read_job_status(f, 13).progress, 1400.0 / 2600);
	expect_near(read_job_status(f, 13).eta, 1200 / 200.0);
	transcript_play(
		f, (const char *const[]){
			   "[15] w1 batch j1 g0 p0 e1 -> merge, merged, j1 round 2, j1 evaluate 2, w1 gets j1 g0 p0 e2",
			   "[15] error j1 2 0.9 -> -",
			   NULL,
		   });
	expect_near(read_job_status(f, 15).progress, 1800.0 / 2600);
	farm_free(f);
}

/* An estimate below the target whose interval is unknown does not end the job; the next one with an interval does. */
static void doubtful_estimate_does_not_end_the_job(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(
		f, (const char *const[]){
			   START("rounds=inf target=0.1"),
			   "[11] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0",
			   "[13] w1 batch j1 g0 p0 e0 -> merge, merged, j1 round 1, j1 evaluate 1, w1 gets j1 g0 p0 e1",
			   NULL,
		   });
	struct event ev = {.kind = EVENT_ERROR_ESTIMATED,
			   .time = 13.5,
			   .error_estimated = {.job = 1,
					       .rounds = 1,
					       .rel_error = 0.05,
					       .rel_mse = 0.002,
					       .degrees = 2000,
					       .doubtful = true,
					       .cpu_seconds = 5}};
	struct update u;
	farm_step(f, &ev, &u);
	struct job_status s = read_job_status(f, 13.5);
	assert_int_equal(s.state, JOB_RUNNING);
	assert_true(isnan(s.rel_error) && s.looks->count == 1 && s.looks->looks[0].is_doubtful);
	farm_free(f);
}

/* Once the parts of the error are known, the forecast of common/film replaces the simple rule. */
static void estimates_of_the_error_give_a_forecast(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(
		f, (const char *const[]){
			   START("rounds=inf target=0.1"),
			   "[11] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0",
			   "[13] w1 batch j1 g0 p0 e0 -> merge, merged, j1 round 1, j1 evaluate 1, w1 gets j1 g0 p0 e1",
			   NULL,
		   });
	struct event ev = {
		.kind = EVENT_ERROR_ESTIMATED,
		.time = 13.5,
		.error_estimated = {
			.job = 1, .rounds = 1, .rel_error = 0.2, .rel_mse = 0.038, .degrees = 2000, .cpu_seconds = 5}};
	struct update u;
	farm_step(f, &ev, &u);
	struct job_status s = read_job_status(f, 13.5);
	assert_int_equal(s.looks->count, 1);
	expect_near(s.looks->looks[0].work, 400);
	expect_near(s.looks->looks[0].cpu_seconds, 5);
	expect_near(s.looks->looks[0].seconds, 2);
	struct forecast_range error;
	assert_true(forecast_current_error(s.looks, &error));
	expect_near(error.middle, sqrt(0.038));
	expect_near(error.high, 0.2);
	/* Half the error needs four times the work: three times the CPU time used so far, at the present rate of 400
	 * mutations in 2.5 s. */
	assert_true(fabs(s.halving_cpu.middle / 15 - 1) < 0.1);
	assert_true(fabs(s.halving_seconds.middle / (1200 / s.rate) - 1) < 0.1);
	/* Four rounds by the rule, so three are still to come; the interval contains that estimate. */
	assert_true(s.eta_low <= s.eta && s.eta <= s.eta_high && s.eta_low >= 400 / s.rate &&
		    s.eta_high < 4000 / s.rate);
	assert_true(s.eta >= 800 / s.rate - 1e-9 && s.eta <= 1600 / s.rate + 1e-9);
	farm_free(f);
}

static void progress_towards_a_time_limit_follows_the_clock(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){START("rounds=inf seconds=20"), NULL});
	expect_near(read_job_status(f, 15).progress, 5.0 / 20);
	expect_near(read_job_status(f, 15).eta, 15);
	expect_near(read_job_status(f, 100).progress, 0.99);
	farm_free(f);
	/* A round of 400 mutations takes two seconds: the tenth is complete one second after the time limit. */
	f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   START("rounds=inf seconds=20"),
				   "[11] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0",
				   "[13] w1 batch j1 g0 p0 e0 -> merge, merged, j1 round 1, w1 gets j1 g0 p0 e1",
				   "[15] w1 batch j1 g0 p0 e1 -> merge, merged, j1 round 2, w1 gets j1 g0 p0 e2",
				   NULL,
			   });
	expect_near(read_job_status(f, 15).eta, 16);
	farm_free(f);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(job_ends_at_its_time_limit),
		cmocka_unit_test(job_ends_at_its_target_error),
		cmocka_unit_test(time_limit_ends_a_job_above_its_target),
		cmocka_unit_test(disagreement_of_chains_sets_the_exit_code),
		cmocka_unit_test(target_met_by_the_last_round_counts),
		cmocka_unit_test(no_light_in_the_bootstrap_ends_the_job),
		cmocka_unit_test(black_image_ends_a_job_without_another_bound),
		cmocka_unit_test(failed_preparation_fails_the_job),
		cmocka_unit_test(an_overflown_sum_fails_the_job),
		cmocka_unit_test(progress_and_rate_follow_merged_mutations),
		cmocka_unit_test(no_eta_without_leases),
		cmocka_unit_test(no_eta_during_the_bootstrap),
		cmocka_unit_test(progress_towards_a_target_error_never_falls),
		cmocka_unit_test(doubtful_estimate_does_not_end_the_job),
		cmocka_unit_test(estimates_of_the_error_give_a_forecast),
		cmocka_unit_test(progress_towards_a_time_limit_follows_the_clock),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
