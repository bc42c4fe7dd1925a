/* SPDX-License-Identifier: Apache-2.0 */
/* The rows of an estimate: each costs what a render with that target costs, in rounds of that render's plan, also if
 * the pilot has gone far beyond the target. */
#include "worker/cli/render/estimate.h"

#include "common/plan/plan.h"
#include "worker/cli/render/pilot_request.h"

#include <jansson.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

/* Returns the estimate as JSON, as printed to stdout. */
static json_t *print_to_json(const struct estimate *s)
{
	FILE *f = tmpfile();
	struct error e;
	assert_non_null(f);
	fflush(stdout);
	int out = dup(STDOUT_FILENO);
	dup2(fileno(f), STDOUT_FILENO);
	int rc = estimate_report(s, true, NULL, &e);
	fflush(stdout);
	dup2(out, STDOUT_FILENO);
	close(out);
	assert_int_equal(rc, 0);
	rewind(f);
	json_t *o = json_loadf(f, 0, NULL);
	fclose(f);
	assert_non_null(o);
	return o;
}

/* Makes looks of an error of `error` after a million samples, which cost a microsecond each. */
static struct forecast_history make_history(double error)
{
	struct forecast_history h = {0};
	for (double work = 1e4; work < 1.01e6; work *= 1.25) {
		double square = error * error * 1e6 / work;
		forecast_add_look(
			&h, &(struct forecast_look){work, 1e-6 * work, 1e-6 * work, square, 1.05 * square, 3000, 0});
	}
	return h;
}

static double expected_number(json_t *row, const char *key)
{
	return json_number_value(json_object_get(json_object_get(row, key), "expected"));
}

static void check_rows(const struct plan_request *request, double speed)
{
	struct plan render, pilot;
	struct error e;
	struct forecast_history looks = make_history(0.004);
	assert_int_equal(pilot_render_plan(request, &render, &e), 0);
	pilot = render;
	pilot.epoch = 1;
	json_t *o = print_to_json(&(struct estimate){.scene = "s.xml",
						     .machine = "here",
						     .request = request,
						     .plan = &render,
						     .pilot = &pilot,
						     .looks = &looks,
						     .bootstrap_cpu_seconds = 0.25,
						     .bootstrap_seconds = 0.25,
						     .speed = speed}),
	       *rows = json_object_get(o, "targets"), *row;
	assert_int_equal(json_array_size(rows), 4);
	size_t i;
	json_array_foreach(rows, i, row)
	{
		struct plan_request one = *request;
		struct plan p;
		one.target_error = json_number_value(json_object_get(row, "error"));
		assert_int_equal(plan_make(&one, &p, &e), 0);
		if (plan_needs_speed(&one, &p)) { /* as hslt-submit does */
			one.speed = speed;
			assert_int_equal(plan_make(&one, &p, &e), 0);
		}
		double round = (double)plan_round_mutations(&p), work = expected_number(row, "mutations");
		double min_work = 1e6 * 0.004 * 0.004 * 1.05 / (one.target_error * one.target_error);
		assert_non_null(json_object_get(row, "reached"));
		assert_true(work >= round && work < 2 * fmax(min_work, round));
		assert_true(fabs(remainder(work, round) / round) < 1e-9);
		assert_true(fabs(expected_number(row, "cpuSeconds") / (1e-6 * work + 0.25) - 1) < 0.05);
	}
	json_decref(o);
}

static void rows_have_the_rounds_of_their_targets(void **state)
{
	(void)state;
	struct plan_request r = {
		.kind = PLAN_SAMPLES, .width = 48, .height = 48, .border = 2, .min_depth = 1, .max_depth = 9};
	strcpy(r.integrator, "path");
	check_rows(&r, 0);
	check_rows(&r, 40);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(rows_have_the_rounds_of_their_targets),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
