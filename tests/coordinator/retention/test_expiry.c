/* SPDX-License-Identifier: Apache-2.0 */
/* Which parts of finished jobs are deleted, and in which order, by a clock that the test sets. */
#include "coordinator/retention/expiry.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#define DAY 86400.0

/* Films and results of 100 bytes each; the jobs ended on days 5, 1, 3, 4, 2. */
static void make_jobs(struct expiry_job jobs[5])
{
	static const double days[] = {5, 1, 3, 4, 2};
	for (int i = 0; i < 5; i++)
		jobs[i] = (struct expiry_job){.id = 10 + (uint64_t)i,
					      .end_order = days[i],
					      .ended_at = days[i] * DAY,
					      .film_bytes = 100,
					      .result_bytes = 100};
}

/* One letter per job, in the order of their ends: . nothing is deleted, f its films, r also its result, x also its
 * record. */
static void expect_deletions(const struct expiry_job jobs[5], const char *what)
{
	char deletions[6] = "";
	for (int i = 0; i < 5; i++) {
		assert_true(i == 0 || jobs[i].ended_at >= jobs[i - 1].ended_at);
		assert_true(!jobs[i].must_drop_record || jobs[i].must_drop_result);
		assert_true(!jobs[i].must_drop_result || jobs[i].must_drop_films || !jobs[i].film_bytes);
		deletions[i] = jobs[i].must_drop_record	  ? 'x'
			       : jobs[i].must_drop_result ? 'r'
			       : jobs[i].must_drop_films  ? 'f'
							  : '.';
	}
	assert_string_equal(deletions, what);
}

static void old_jobs_are_deleted_by_age(void **state)
{
	(void)state;
	struct expiry_job jobs[5];
	struct expiry_limits l = {3 * DAY, 0};
	make_jobs(jobs);
	expiry_choose_deletions(jobs, 5, &l, 5 * DAY);
	expect_deletions(jobs, "r....");
	expiry_choose_deletions(jobs, 5, &l, 6.5 * DAY);
	expect_deletions(jobs, "rrr..");
	expiry_choose_deletions(jobs, 5, &l, 33.5 * DAY);
	expect_deletions(jobs, "xxxrr");
	expiry_choose_deletions(jobs, 5, &l, -100 * DAY); /* the clock jumps back */
	expect_deletions(jobs, ".....");
	l.max_age_seconds = 0;
	expiry_choose_deletions(jobs, 5, &l, 1e6 * DAY);
	expect_deletions(jobs, ".....");
}

static void oldest_jobs_are_deleted_for_space(void **state)
{
	(void)state;
	struct expiry_job jobs[5];
	struct expiry_limits l = {0, 1000};
	make_jobs(jobs);
	expiry_choose_deletions(jobs, 5, &l, 5 * DAY);
	expect_deletions(jobs, ".....");
	l.max_bytes = 999;
	expiry_choose_deletions(jobs, 5, &l, 5 * DAY);
	expect_deletions(jobs, "f....");
	l.max_bytes = 550; /* all films go before any result */
	expiry_choose_deletions(jobs, 5, &l, 5 * DAY);
	expect_deletions(jobs, "fffff");
	l.max_bytes = 300;
	expiry_choose_deletions(jobs, 5, &l, 5 * DAY);
	expect_deletions(jobs, "rrfff");
}

static void job_being_fetched_stays(void **state)
{
	(void)state;
	struct expiry_job jobs[5];
	struct expiry_limits l = {1 * DAY, 0};
	make_jobs(jobs);
	jobs[1].is_in_use = true; /* the oldest job */
	expiry_choose_deletions(jobs, 5, &l, 100 * DAY);
	expect_deletions(jobs, ".xxxx");
	l = (struct expiry_limits){0, 300};
	expiry_choose_deletions(jobs, 5, &l, 5 * DAY);
	expect_deletions(jobs, "frrff");
}

static void limits_of_age_and_space_apply_together(void **state)
{
	(void)state;
	struct expiry_job jobs[5];
	struct expiry_limits l = {3 * DAY, 700};
	make_jobs(jobs);
	expiry_choose_deletions(jobs, 5, &l, 5 * DAY); /* one job by age, and another for 100 bytes */
	expect_deletions(jobs, "rf...");
	expiry_choose_deletions(jobs, 0, &l, 5 * DAY);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(old_jobs_are_deleted_by_age),
		cmocka_unit_test(oldest_jobs_are_deleted_for_space),
		cmocka_unit_test(job_being_fetched_stays),
		cmocka_unit_test(limits_of_age_and_space_apply_together),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
