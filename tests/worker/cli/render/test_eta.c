/* SPDX-License-Identifier: Apache-2.0 */
/* The remaining time of a render: none from the bootstrap alone, then from the speed of the rounds, and the least of
 * the bounds. */
#include "worker/cli/render/eta.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

static const struct plan open_plan = {.kind = PLAN_SAMPLES, .rounds = 8};

/* The whole bootstrap, 64 of 576 leases, took 0.1 s: this says nothing about rounds. */
static void bootstrap_predicts_no_remaining_time(void **state)
{
	(void)state;
	struct local_progress p = {.leases_done = 64, .leases_total = 576, .seconds = 0.1, .rounds_remaining = 8};
	assert_true(isnan(eta_seconds(&open_plan, &p, 0)));
}

static void remaining_time_follows_completed_rounds(void **state)
{
	(void)state;
	struct local_progress p = {.leases_done = 80,
				   .leases_total = 576,
				   .seconds = 2.1,
				   .rounds = 0.25,
				   .round_seconds = 2,
				   .rounds_remaining = 7.75};
	assert_true(fabs(eta_seconds(&open_plan, &p, 0) / 62 - 1) < 1e-12);
	p.rounds_remaining = INFINITY;
	assert_true(isnan(eta_seconds(&open_plan, &p, 0)));
}

static void remaining_time_ends_at_the_first_bound(void **state)
{
	(void)state;
	struct plan timed = open_plan;
	struct local_progress p = {.seconds = 2, .rounds = 2, .round_seconds = 1.5, .rounds_remaining = 6};
	timed.seconds = 3;
	assert_true(fabs(eta_seconds(&open_plan, &p, 3.5) - 1.5) < 1e-12);
	assert_true(fabs(eta_seconds(&open_plan, &p, 100) - 4.5) < 1e-12);
	assert_true(eta_seconds(&open_plan, &p, 1) == 0);
	assert_true(fabs(eta_seconds(&timed, &p, 100) - 1.5) < 1e-12); /* the round in which the time is over ends */
	p = (struct local_progress){.seconds = 1, .rounds_remaining = 8};
	assert_true(eta_seconds(&timed, &p, 0) == 2);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(bootstrap_predicts_no_remaining_time),
		cmocka_unit_test(remaining_time_follows_completed_rounds),
		cmocka_unit_test(remaining_time_ends_at_the_first_bound),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
