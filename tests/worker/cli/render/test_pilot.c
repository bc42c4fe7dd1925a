/* SPDX-License-Identifier: Apache-2.0 */
/* The plan of a pilot: equal to the render's except for its epoch, with enough rounds in its time and a bounded
 * bootstrap. Checked for a range of costs per sample. */
#include "worker/cli/render/pilot_request.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

static struct plan_request make_request(enum plan_kind kind, uint32_t size)
{
	struct plan_request r = {
		.kind = kind, .width = size, .height = size, .border = 1, .seed = 5, .min_depth = 1, .max_depth = 9};
	strcpy(r.integrator, kind == PLAN_CHAINS ? "pssmlt" : "path");
	return r;
}

static void pilot_of_chains_fits_into_its_time(void **state)
{
	(void)state;
	struct plan_request request = make_request(PLAN_CHAINS, 100), probe, pilot;
	struct plan render, plan;
	struct error e;
	for (double sample = 1e-7; sample < 1e-3; sample *= 7) {
		request.target_error = 0.02;
		assert_int_equal(pilot_render_plan(&request, &render, &e), 0);
		assert_true(pilot_probe_request(&request, &render, &probe));
		assert_int_equal(plan_make(&probe, &plan, &e), 0);
		assert_true(plan.rounds == 1 && plan.chains == render.chains && plan.groups == render.groups);
		struct pilot_cost cost = {sample * (double)plan.bootstrap,
					  sample * (double)plan_round_mutations(&plan)};
		pilot_request(&request, &render, &probe, &cost, 60, &pilot);
		assert_int_equal(plan_make(&pilot, &plan, &e), 0);
		assert_true(plan.chains == render.chains && plan.groups == render.groups && plan.seed == 5);
		double bootstrap = sample * (double)plan.bootstrap,
		       rounds = sample * (double)plan_round_mutations(&plan);
		assert_true(bootstrap <= 60 * 0.26 && plan.bootstrap <= render.bootstrap);
		assert_true((60 - bootstrap) / rounds >= PILOT_ROUNDS - 1 || plan.epoch == 1);
		assert_true(plan.epoch <= render.epoch);
	}
}

/* 8,000 rays per bootstrap sample, 4 ms: neither a probe nor a one-minute pilot may begin with minutes of bootstrap. */
static void pilot_with_slow_samples_has_a_short_bootstrap(void **state)
{
	(void)state;
	struct plan_request request = make_request(PLAN_CHAINS, 100), probe, pilot;
	struct plan render, plan;
	struct error e;
	request.rays = (struct plan_rays){8000, 90};
	assert_int_equal(pilot_render_plan(&request, &render, &e), 0);
	assert_true(pilot_probe_request(&request, &render, &probe));
	assert_int_equal(plan_make(&probe, &plan, &e), 0);
	assert_int_equal(plan.bootstrap, 256);
	struct pilot_cost cost = {0.004 * 256, 1};
	pilot_request(&request, &render, &probe, &cost, 60, &pilot);
	assert_int_equal(plan_make(&pilot, &plan, &e), 0);
	assert_true(0.004 * (double)plan.bootstrap <= 60 * 0.26 && plan.bootstrap >= 3000);
}

static void pilot_of_samples_needs_no_probe(void **state)
{
	(void)state;
	struct plan_request request = make_request(PLAN_SAMPLES, 4000), probe, pilot;
	struct plan render, plan;
	struct error e;
	assert_int_equal(pilot_render_plan(&request, &render, &e), 0);
	assert_true(render.target_error > 0);
	/* One sample per pixel and group is a round and long enough. */
	assert_false(pilot_probe_request(&request, &render, &probe));
	pilot_request(&request, &render, &probe, NULL, 60, &pilot);
	assert_int_equal(plan_make(&pilot, &plan, &e), 0);
	assert_true(plan.epoch == 1 && plan.groups == render.groups && plan.seconds == 60 && plan.rounds == UINT64_MAX);
	request.groups = 1;
	assert_int_equal(pilot_render_plan(&request, &render, &e), -EINVAL);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(pilot_of_chains_fits_into_its_time),
		cmocka_unit_test(pilot_with_slow_samples_has_a_short_bootstrap),
		cmocka_unit_test(pilot_of_samples_needs_no_probe),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
