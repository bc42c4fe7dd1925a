/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The plan of an extended job. It has the new bounds and everything else as before, so that a job extended twice gives
 * the bits of one long job; bounds that are already met, or at which no job could end, are refused with a sentence.
 */
#include "coordinator/jobs/extend.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

static struct plan_request make_request(enum plan_kind kind)
{
	struct plan_request r = {
		.integrator = "hslt", .kind = kind, .width = 48, .height = 40, .border = 2, .seed = 5, .max_depth = 16};
	if (kind == PLAN_CHAINS)
		strcpy(r.mixture, "independent=0.1,hslt=0.9");
	else
		strcpy(r.integrator, "path");
	return r;
}

struct test_job {
	struct plan_request request;
	struct plan plan;
	struct extension_basis progress;
	struct error e;
};

static void make_job(struct test_job *j, const struct plan_request *r, uint64_t rounds, bool ended)
{
	j->request = *r;
	assert_int_equal(plan_make(r, &j->plan, &j->e), 0);
	j->progress = (struct extension_basis){
		.rounds = rounds ? rounds : j->plan.rounds, .seconds = 10, .error = NAN, .has_ended = ended};
}

static int try_extension(struct test_job *j, struct extension x)
{
	struct plan out;
	int rc = extend_plan(&j->plan, &x, &j->progress, &j->request, &out, &j->e);
	if (!rc)
		j->plan = out;
	return rc;
}

static void expect_refusal(struct test_job *j, struct extension x, const char *text)
{
	assert_int_equal(try_extension(j, x), -EINVAL);
	if (!strstr(j->e.text, text))
		fail_msg("'%s' is not in '%s'", text, j->e.text);
}

/* Whether extended once or twice, the plan is that of one long job, cut where the short one ended. */
static void extended_plan_is_that_of_one_long_job(void **state)
{
	(void)state;
	for (int kind = 0; kind < 2; kind++)
		for (uint64_t spp = 1; spp < 60; spp += 7) {
			struct plan_request r = make_request(kind ? PLAN_CHAINS : PLAN_SAMPLES), all;
			struct test_job j;
			struct plan one;
			r.spp = spp;
			make_job(&j, &r, 0, true);
			all = r;
			all.spp = spp + 100 + 3;
			all.chains = j.plan.chains;
			all.groups = j.plan.groups;
			all.parts = j.plan.parts;
			all.bootstrap = j.plan.bootstrap;
			all.epoch = j.plan.epoch;
			assert_int_equal(plan_make(&all, &one, &j.e), 0);
			assert_int_equal(try_extension(&j, (struct extension){.spp = 100}), 0);
			assert_true(j.plan.rounds > j.progress.rounds);
			j.progress.has_ended = spp % 2; /* while the job runs, or when it is done */
			j.progress.rounds = spp % 2 ? j.plan.rounds : j.plan.rounds - 1;
			int rc = try_extension(&j, (struct extension){.mutations = 3 * 48 * 40});
			if (rc) /* the last round was already larger by as many samples */
				assert_true(j.progress.has_ended && one.rounds == j.plan.rounds);
			assert_memory_equal(&one, &j.plan, sizeof one);
		}
}

static void extension_replaces_the_bound_that_was_met(void **state)
{
	(void)state;
	struct plan_request r = make_request(PLAN_CHAINS);
	struct test_job j;
	r.spp = 100;
	r.seconds = 10;
	r.target_error = 0.05;
	/* the job met its error: more samples replace that bound, but not the time limit */
	make_job(&j, &r, 3, true);
	j.progress.seconds = 5;
	j.progress.error = 0.04;
	uint64_t rounds = j.plan.rounds;
	expect_refusal(&j, (struct extension){.target_error = 0.045}, "already 4 %");
	make_job(&j, &r, 3, true);
	j.progress.seconds = 5;
	j.progress.error = 0.04;
	assert_int_equal(try_extension(&j, (struct extension){.spp = 100}), 0);
	assert_true(j.plan.target_error == 0 && j.plan.seconds == 10 && j.plan.rounds > rounds);
	/* a lower target leaves the other bounds as they were */
	make_job(&j, &r, 3, true);
	j.progress.seconds = 5;
	j.progress.error = 0.04;
	assert_int_equal(try_extension(&j, (struct extension){.target_error = 0.01}), 0);
	assert_true(j.plan.target_error == 0.01 && j.plan.seconds == 10 && j.plan.rounds == rounds);
	/* the time limit was met */
	make_job(&j, &r, 3, true);
	assert_int_equal(try_extension(&j, (struct extension){.spp = 1}), 0);
	assert_true(j.plan.seconds == 0 && j.plan.target_error == 0.05);
	make_job(&j, &r, 3, true);
	assert_int_equal(try_extension(&j, (struct extension){.seconds = 3}), 0);
	assert_true(j.plan.seconds == 13 && j.plan.rounds == rounds);
	/* all rounds were done: an error or a time says how long the job goes on */
	make_job(&j, &r, 0, true);
	j.progress.seconds = 5;
	assert_int_equal(try_extension(&j, (struct extension){.target_error = 0.01}), 0);
	assert_true(j.plan.rounds == UINT64_MAX && j.plan.seconds == 10);
	/* the bounds of a running job are kept */
	make_job(&j, &r, 3, false);
	j.progress.error = 0.04;
	assert_int_equal(try_extension(&j, (struct extension){.seconds = 3}), 0);
	assert_true(j.plan.seconds == 13 && j.plan.rounds == rounds && j.plan.target_error == 0.05);
}

/* The bounds of an extension that was cancelled no longer apply: the next extension continues from what is done. */
static void extension_after_a_cancelled_one_continues_from_what_is_done(void **state)
{
	(void)state;
	struct plan_request r = make_request(PLAN_CHAINS);
	struct test_job j;
	r.spp = 100;
	r.seconds = 1000;
	r.target_error = 0.05;
	make_job(&j, &r, 3, true);
	j.progress.was_extension_cancelled = true;
	uint64_t done = 3 * plan_round_mutations(&j.plan), more = 8 * 48 * 40, round = plan_round_mutations(&j.plan);
	assert_int_equal(try_extension(&j, (struct extension){.spp = 8}), 0);
	assert_int_equal(j.plan.rounds, (done + more + round - 1) / round);
	assert_true(j.plan.seconds == 0 && j.plan.target_error == 0);
	make_job(&j, &r, 3, true);
	j.progress.was_extension_cancelled = true;
	assert_int_equal(try_extension(&j, (struct extension){.seconds = 3}), 0);
	assert_true(j.plan.rounds == UINT64_MAX && j.plan.seconds == 13 && j.plan.target_error == 0);
}

/* With one sample per pixel the job has one group, so its error is never known and it would never end. */
static void target_error_that_is_never_known_is_refused(void **state)
{
	(void)state;
	struct plan_request r = make_request(PLAN_SAMPLES);
	struct test_job j;
	r.spp = 1;
	make_job(&j, &r, 0, true);
	assert_int_equal(j.plan.groups, 1);
	expect_refusal(&j, (struct extension){.target_error = 0.1}, "a single group of samples gives no error");
	make_job(&j, &r, 0, true);
	assert_int_equal(try_extension(&j, (struct extension){.spp = 8, .target_error = 0.1}), 0);
	make_job(&j, &r, 0, true);
	assert_int_equal(try_extension(&j, (struct extension){.seconds = 8, .target_error = 0.1}), 0);
}

static void extension_without_a_usable_bound_is_refused(void **state)
{
	(void)state;
	struct plan_request r = make_request(PLAN_CHAINS);
	struct test_job j;
	r.seconds = 10;
	make_job(&j, &r, 7, true);
	uint64_t epoch = j.plan.epoch;
	/* Beyond the mutations that are done. */
	assert_int_equal(try_extension(&j, (struct extension){.mutations = 1}), 0);
	assert_true(j.plan.rounds == 8 && j.plan.seconds == 0 && j.plan.epoch == epoch);
	make_job(&j, &r, 7, false);
	expect_refusal(&j, (struct extension){.spp = 8}, "no bound on samples");
	make_job(&j, &r, 7, false);
	expect_refusal(&j, (struct extension){.job = 1}, "a bound is missing");
	expect_refusal(&j, (struct extension){.seconds = NAN, .spp = 1}, "an invalid time or error");
	expect_refusal(&j, (struct extension){.seconds = -1, .spp = 1}, "an invalid time or error");
	expect_refusal(&j, (struct extension){.target_error = INFINITY}, "an invalid time or error");
	r.seconds = 0;
	r.spp = 4;
	make_job(&j, &r, 0, true);
	expect_refusal(&j, (struct extension){.spp = UINT64_MAX}, "can be counted");
	make_job(&j, &r, 0, true);
	expect_refusal(&j, (struct extension){.mutations = UINT64_MAX}, "can be counted");
	make_job(&j, &r, 0, true);
	assert_int_equal(try_extension(&j, (struct extension){.mutations = UINT64_C(1) << 63}), -EINVAL);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(extended_plan_is_that_of_one_long_job),
		cmocka_unit_test(extension_replaces_the_bound_that_was_met),
		cmocka_unit_test(extension_after_a_cancelled_one_continues_from_what_is_done),
		cmocka_unit_test(target_error_that_is_never_known_is_refused),
		cmocka_unit_test(extension_without_a_usable_bound_is_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
