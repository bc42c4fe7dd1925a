/* SPDX-License-Identifier: Apache-2.0 */
/* Every plan ends: a plan whose only bound is an error that can never be known, that of a single group of samples, is
 * refused. */
#include "common/plan/plan.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

static void a_single_group_needs_another_bound(void **state)
{
	(void)state;
	struct error e;
	for (int kind = 0; kind < 2; kind++) {
		struct plan_request r = {.integrator = "hslt",
					 .kind = kind ? PLAN_CHAINS : PLAN_SAMPLES,
					 .width = 64,
					 .height = 32,
					 .max_depth = 8,
					 .groups = 1,
					 .target_error = 0.1};
		struct plan p;
		assert_int_equal(plan_make(&r, &p, &e), -EINVAL);
		assert_non_null(strstr(e.text, "a single group of samples gives no error"));
		r.seconds = 5;
		assert_int_equal(plan_make(&r, &p, &e), 0);
		r.seconds = 0;
		r.spp = 5;
		assert_int_equal(plan_make(&r, &p, &e), 0);
		r.spp = 0;
		r.groups = 2;
		assert_int_equal(plan_make(&r, &p, &e), 0);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(a_single_group_needs_another_bound)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
