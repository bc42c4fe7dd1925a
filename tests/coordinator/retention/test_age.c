/* SPDX-License-Identifier: Apache-2.0 */
/* Which parts of finished jobs are deleted, and in which order, by a clock that the test sets. */
#include "coordinator/retention/age.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#define DAY 86400.0

/* Films and results of 100 bytes each; the jobs ended on days 5, 1, 3, 4, 2. */
static void fill(struct age_job jobs[5])
{
	static const double days[] = {5, 1, 3, 4, 2};
	for (int i = 0; i < 5; i++)
		jobs[i] = (struct age_job){
			.id = 10 + (uint64_t)i, .order = days[i], .ended = days[i] * DAY, .films = 100, .result = 100};
}

/* One letter per job, in the order of their ends: . nothing is deleted, f its films, r also its result, x also its
 * record. */
static void expect(const struct age_job jobs[5], const char *what)
{
	char seen[6] = "";
	for (int i = 0; i < 5; i++) {
		assert_true(i == 0 || jobs[i].ended >= jobs[i - 1].ended);
		assert_true(!jobs[i].no_record || jobs[i].no_result);
		assert_true(!jobs[i].no_result || jobs[i].no_films || !jobs[i].films);
		seen[i] = jobs[i].no_record ? 'x' : jobs[i].no_result ? 'r' : jobs[i].no_films ? 'f' : '.';
	}
	assert_string_equal(seen, what);
}

static void by_age(void **state)
{
	(void)state;
	struct age_job jobs[5];
	struct age_limits l = {3 * DAY, 0};
	fill(jobs);
	age_choose(jobs, 5, &l, 5 * DAY);
	expect(jobs, "r....");
	age_choose(jobs, 5, &l, 6.5 * DAY);
	expect(jobs, "rrr..");
	age_choose(jobs, 5, &l, 33.5 * DAY);
	expect(jobs, "xxxrr");
	age_choose(jobs, 5, &l, -100 * DAY); /* the clock jumps back */
	expect(jobs, ".....");
	l.seconds = 0;
	age_choose(jobs, 5, &l, 1e6 * DAY);
	expect(jobs, ".....");
}

static void by_space(void **state)
{
	(void)state;
	struct age_job jobs[5];
	struct age_limits l = {0, 1000};
	fill(jobs);
	age_choose(jobs, 5, &l, 5 * DAY);
	expect(jobs, ".....");
	l.bytes = 999;
	age_choose(jobs, 5, &l, 5 * DAY);
	expect(jobs, "f....");
	l.bytes = 550; /* all films go before any result */
	age_choose(jobs, 5, &l, 5 * DAY);
	expect(jobs, "fffff");
	l.bytes = 300;
	age_choose(jobs, 5, &l, 5 * DAY);
	expect(jobs, "rrfff");
}

static void what_is_fetched_stays(void **state)
{
	(void)state;
	struct age_job jobs[5];
	struct age_limits l = {1 * DAY, 0};
	fill(jobs);
	jobs[1].busy = true; /* the oldest job */
	age_choose(jobs, 5, &l, 100 * DAY);
	expect(jobs, ".xxxx");
	l = (struct age_limits){0, 300};
	age_choose(jobs, 5, &l, 5 * DAY);
	expect(jobs, "frrff");
}

static void by_age_and_by_size(void **state)
{
	(void)state;
	struct age_job jobs[5];
	struct age_limits l = {3 * DAY, 700};
	fill(jobs);
	age_choose(jobs, 5, &l, 5 * DAY); /* one job by age, and another for 100 bytes */
	expect(jobs, "rf...");
	age_choose(jobs, 0, &l, 5 * DAY);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(by_age),
		cmocka_unit_test(by_space),
		cmocka_unit_test(what_is_fetched_stays),
		cmocka_unit_test(by_age_and_by_size),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
