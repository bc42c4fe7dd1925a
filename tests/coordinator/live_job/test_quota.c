/* SPDX-License-Identifier: Apache-2.0 */
/* Quotas at their edges: the exact limit passes, one more does not, and a product that overflows exceeds every limit.
 */
#include "common/film/canvas.h"
#include "coordinator/live_job/quota.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <string.h>

static struct plan plan;

static int make_plan(void **state)
{
	(void)state;
	plan = (struct plan){.kind = PLAN_SAMPLES,
			     .width = 100,
			     .height = 50,
			     .crop_width = 100,
			     .crop_height = 50,
			     .groups = 16,
			     .parts = 4,
			     .epoch = 1,
			     .rounds = 3};
	return 0;
}

static int check_quota(const struct quota *q, uint64_t jobs, uint64_t bytes, uint64_t asset_bytes)
{
	struct error e = {""};
	int rc = quota_check(q, &(struct quota_usage){jobs, bytes}, &plan, asset_bytes, &e);
	assert_true(rc == 0 || (rc == -EDQUOT && strncmp(e.text, "quota: ", 7) == 0));
	return rc;
}

/* The sentence names the limit and not the number of live jobs, which may exceed a limit that was lowered. */
static void refusal_names_the_limit(void **state)
{
	(void)state;
	struct error e;
	assert_int_equal(quota_check(&(struct quota){.max_jobs = 2}, &(struct quota_usage){5, 0}, &plan, 0, &e),
			 -EDQUOT);
	assert_non_null(strstr(e.text, "at most 2 live jobs"));
}

static void no_quota_is_no_limit(void **state)
{
	(void)state;
	plan.rounds = UINT64_MAX;
	assert_int_equal(check_quota(&(struct quota){0}, UINT64_MAX, UINT64_MAX, UINT64_MAX), 0);
	plan.rounds = 3;
}

static void each_quota_passes_at_its_limit(void **state)
{
	(void)state;
	uint64_t mutations = 3 * plan_round_mutations(&plan);
	assert_true(mutations > 3);
	assert_int_equal(check_quota(&(struct quota){.max_jobs = 2}, 1, 0, 0), 0);
	assert_int_equal(check_quota(&(struct quota){.max_jobs = 2}, 2, 0, 0), -EDQUOT);
	assert_int_equal(check_quota(&(struct quota){.max_asset_bytes = 10}, 0, 4, 6), 0);
	assert_int_equal(check_quota(&(struct quota){.max_asset_bytes = 10}, 0, 4, 7), -EDQUOT);
	assert_int_equal(check_quota(&(struct quota){.max_asset_bytes = 10}, 0, 11, 0), -EDQUOT);
	assert_int_equal(check_quota(&(struct quota){.max_asset_bytes = 10}, 0, 4, UINT64_MAX), -EDQUOT);
	uint64_t films = canvas_bytes(&plan);
	assert_true(films >= UINT64_C(72) * 16 * 100 * 50);
	assert_int_equal(check_quota(&(struct quota){.max_film_bytes = films}, 0, 0, 0), 0);
	assert_int_equal(check_quota(&(struct quota){.max_film_bytes = films - 1}, 0, 0, 0), -EDQUOT);
	plan.groups = 17;
	assert_int_equal(check_quota(&(struct quota){.max_film_bytes = films}, 0, 0, 0), -EDQUOT);
	plan.crop_width = 50; /* the crop of a film as large */
	assert_int_equal(check_quota(&(struct quota){.max_film_bytes = films}, 0, 0, 0), 0);
	plan.groups = 16;
	plan.crop_width = 100;
	assert_int_equal(check_quota(&(struct quota){.max_mutations = mutations}, 0, 0, 0), 0);
	assert_int_equal(check_quota(&(struct quota){.max_mutations = mutations - 1}, 0, 0, 0), -EDQUOT);
	plan.rounds = UINT64_MAX / 2; /* the product overflows */
	assert_int_equal(check_quota(&(struct quota){.max_mutations = UINT64_MAX - 1}, 0, 0, 0), -EDQUOT);
	plan.rounds = UINT64_MAX; /* until the time limit */
	assert_int_equal(check_quota(&(struct quota){.max_mutations = UINT64_MAX}, 0, 0, 0), -EDQUOT);
	plan.rounds = 3;
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(no_quota_is_no_limit),
					   cmocka_unit_test(refusal_names_the_limit),
					   cmocka_unit_test(each_quota_passes_at_its_limit)};
	return cmocka_run_group_tests(tests, make_plan, NULL);
}
