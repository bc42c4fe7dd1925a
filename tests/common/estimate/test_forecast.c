/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Forecasts against renders simulated with exact chi-square statistics: groups whose pixels' deviations are Brownian in
 * work. Level: each share of intervals that hold is a binomial of 300 renders whose expectation is 0.93 or more (the
 * prior of the trend makes intervals wider than the noise alone); it is below 0.86 with a probability of less than
 * 1e-6. Power: intervals of half the width hold in 0.67 or less of the renders, those of a wrong law of work in none.
 */
#include "common/json/estimate_json.h"
#include "common/estimate/merge.h"
#include "common/estimate/quantile.h"
#include "tests/support/dice.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <cmocka.h>

/* Chi-square deviate for 14 degrees of freedom and more (Wilson and Hilferty 1931). */
static double chi_square_deviate(struct dice *d, double degrees)
{
	double s = 2 / (9 * degrees), root = 1 - s + sqrt(s) * dice_normal(d);
	return degrees * root * root * root;
}

/* 5 % quantile of chi-square (Wilson and Hilferty 1931). */
static double chi_square_quantile_5(double degrees)
{
	double s = 2 / (9 * degrees), root = 1 - s - 1.6448536269514722 * sqrt(s);
	return root > 0 ? degrees * root * root * root : 0;
}

/* A simulated render: sum of squares over `degrees` dimensions of a Brownian motion whose variance grows by 1 per unit
 * of work. */
struct simulated_render {
	double degrees, square, work, scale; /* relMSE = scale / work */
};

static struct forecast_look estimate_at_work(struct simulated_render *w, double work, struct dice *d)
{
	double step = work - w->work, z = dice_normal(d);
	w->square += 2 * sqrt(w->square * step) * z + step * (z * z + chi_square_deviate(d, w->degrees - 1));
	w->work = work;
	struct forecast_look l = {
		.work = work, .cpu_seconds = 2e-6 * work * (1 + 0.01 * dice_normal(d)), .degrees = w->degrees};
	l.seconds = l.cpu_seconds / 2;
	l.rel_mse = w->scale / work * w->square / (w->degrees * work);
	l.rel_mse_upper = l.rel_mse * w->degrees / chi_square_quantile_5(w->degrees);
	return l;
}

static struct plan make_plan(uint64_t epoch)
{
	return (struct plan){.kind = PLAN_CHAINS, .groups = 16, .chains = 1024, .epoch = epoch, .target_error = 1e-3};
}

static struct forecast_history simulate_pilot(double degrees, double scale, uint64_t rounds, struct dice *d)
{
	struct plan p = make_plan(64);
	struct forecast_history h = {0};
	struct simulated_render w = {.degrees = degrees, .scale = scale};
	for (uint64_t r = 1; r <= rounds; r = merge_next_error_rounds(&p, r)) {
		struct forecast_look l = estimate_at_work(&w, (double)r * (double)plan_round_mutations(&p), d);
		forecast_add_look(&h, &l);
	}
	return h;
}

static double work_at_stop(double degrees, double scale, const struct plan *p, double target, struct dice *d)
{
	struct simulated_render w = {.degrees = degrees, .scale = scale};
	for (uint64_t r = 1;; r = merge_next_error_rounds(p, r)) {
		struct forecast_look l = estimate_at_work(&w, (double)r * (double)plan_round_mutations(p), d);
		if (sqrt(l.rel_mse_upper) <= target)
			return l.work;
	}
}

static void forecast_intervals_hold(void **state)
{
	(void)state;
	static const double degrees[] = {15, 150, 3000};
	struct dice d = dice_for_test("forecast intervals_hold");
	size_t runs = dice_scaled_count(300);
	struct plan p = make_plan(48);
	for (size_t k = 0; k < sizeof degrees / sizeof *degrees; k++) {
		size_t held_count = 0;
		double mean_log_width = 0, mean_log_bias = 0;
		for (size_t i = 0; i < runs; i++) {
			double scale = exp(dice_between(&d, 5, 9));
			struct forecast_history h = simulate_pilot(degrees[k], scale, 22, &d);
			struct forecast_cost c;
			double target = sqrt(h.looks[h.count - 1].rel_mse / dice_between(&d, 2, 9));
			assert_true(forecast_cost_of_target(&h, &p, target, FORECAST_NEW, &c));
			double work = work_at_stop(degrees[k], scale, &p, target, &d);
			held_count += c.work.low <= work && work <= c.work.high;
			mean_log_width += log(c.work.high / c.work.low) / (double)runs;
			mean_log_bias += log(c.work.middle / work) / (double)runs;
		}
		printf("%4.0f degrees: %.3f of the intervals hold, high over low %.2f, predicted over real %.3f\n",
		       degrees[k], (double)held_count / (double)runs, exp(mean_log_width), exp(mean_log_bias));
		if (runs >= 300) /* with fewer runs this only shows that nothing breaks */
			assert_true((double)held_count >= 0.86 * (double)runs);
		assert_true(exp(mean_log_width) < (degrees[k] < 100 ? 16 : 4));
		if (runs >= 300)
			assert_true(fabs(mean_log_bias) < 0.12);
	}
}

/* A render's forecast from its own estimates takes into account what has been rendered already. */
static void forecast_intervals_from_own_estimates_hold(void **state)
{
	(void)state;
	struct dice d = dice_for_test("forecast own_looks_tell_more");
	struct plan p = make_plan(64);
	size_t runs = dice_scaled_count(100), held_count = 0;
	for (size_t i = 0; i < runs; i++) {
		struct simulated_render w = {.degrees = 400, .scale = 1000};
		struct forecast_history h = {0};
		struct forecast_cost c = {.work = {.low = 0}};
		double target = sqrt(1000 / (400.0 * (double)plan_round_mutations(&p)));
		for (uint64_t r = 1;; r = merge_next_error_rounds(&p, r)) {
			struct forecast_look l = estimate_at_work(&w, (double)r * (double)plan_round_mutations(&p), &d);
			if (sqrt(l.rel_mse_upper) <= target) {
				held_count += c.work.low <= l.work && l.work <= c.work.high;
				break;
			}
			forecast_add_look(&h, &l);
			if (r > 150)
				continue;
			assert_true(forecast_cost_of_target(&h, &p, target, FORECAST_SAME, &c));
			assert_true(c.work.low > l.work && c.work.low <= c.work.middle && c.work.middle <= c.work.high);
			assert_true(c.cpu_seconds.low > l.cpu_seconds);
		}
	}
	printf("own looks: %.3f hold\n", (double)held_count / (double)runs);
	if (runs >= 100)
		assert_true((double)held_count >= 0.8 * (double)runs);
}

static void forecast_stops_are_rounds_with_an_estimate(void **state)
{
	(void)state;
	struct dice d = dice_for_test("forecast stops_are_on_the_ladder");
	struct plan p = make_plan(1000);
	struct forecast_history h = simulate_pilot(100, 3000, 30, &d);
	for (double target = 0.5; target > 1e-4; target /= 1.7) {
		struct forecast_cost c;
		assert_true(forecast_cost_of_target(&h, &p, target, FORECAST_NEW, &c));
		const double ends[] = {c.rounds.low, c.rounds.middle, c.rounds.high};
		for (int i = 0; i < 3; i++)
			assert_true(merge_error_is_due(&p, (uint64_t)ends[i]));
		assert_true(c.work.middle == c.rounds.middle * (double)plan_round_mutations(&p));
	}
}

static void halving_the_error_costs_three_times_the_work_done(void **state)
{
	(void)state;
	struct plan p = make_plan(64);
	struct forecast_history h = {0};
	for (double work = 1e5; work < 1e7; work *= 1.3)
		forecast_add_look(
			&h, &(struct forecast_look){work, 1e-6 * work, 2e-6 * work, 1000 / work, 1050 / work, 3000, 0});
	struct forecast_cost c;
	struct forecast_range error;
	const struct forecast_look *end = &h.looks[h.count - 1];
	assert_true(forecast_cost_of_halving(&h, &p, &c));
	assert_true(fabs(c.work.middle / (3 * end->work) - 1) < 0.05);
	assert_true(fabs(c.cpu_seconds.middle / (3 * end->cpu_seconds) - 1) < 0.07);
	assert_true(fabs(c.seconds.middle / (3 * end->seconds) - 1) < 0.07);
	assert_true(c.work.low < 3 * end->work && c.work.high > 3 * end->work);
	assert_true(forecast_error_at(&h, 4 * end->work, &error));
	assert_true(fabs(error.middle / (0.5 * sqrt(end->rel_mse)) - 1) < 0.05);
}

/* Light that comes in bursts: the error falls more slowly than by the rule, and the forecast follows that trend. */
static void slower_convergence_raises_the_forecast(void **state)
{
	(void)state;
	struct plan p = make_plan(64);
	double middle[2];
	for (int i = 0; i < 2; i++) {
		struct forecast_history h = {0};
		struct forecast_cost c;
		double power = i ? -0.6 : -1;
		for (double work = 1e5; work < 2e6; work *= 1.25)
			forecast_add_look(&h, &(struct forecast_look){work, work, work, pow(work, power),
								      1.05 * pow(work, power), 3000, 0});
		const struct forecast_look *end = &h.looks[h.count - 1];
		assert_true(forecast_cost_of_target(&h, &p, sqrt(end->rel_mse_upper / 6), FORECAST_NEW, &c));
		middle[i] = c.work.middle / (6 * end->work);
	}
	printf("work over that of the rule: %.2f, with a trend of 0.4 %.2f\n", middle[0], middle[1]);
	assert_true(middle[0] > 0.85 && middle[0] < 1.25);
	assert_true(middle[1] > 1.2 * middle[0] && middle[1] < 2.5);
}

/* Makes estimates in doubt: their interval is unknown, and a multiple of the estimate counts where there is one. */
static struct forecast_history make_doubtful_history(double factor, unsigned known_count)
{
	struct forecast_history h = {0};
	unsigned i = 0;
	for (double work = 1e5; work < 1e6; work *= 1.3, i++) {
		double error = 20000 / work;
		bool clear = i % 9 < known_count, rare = !clear && factor > 0;
		forecast_add_look(&h, &(struct forecast_look){work, work, work, error,
							      rare ? factor * factor * error : 1.05 * error, 3000,
							      !clear && !rare});
	}
	return h;
}

/* A user who waits for an error in doubt waits until the estimate is a fraction of the target, and below a small error.
 */
static void doubtful_render_stops_well_below_the_target(void **state)
{
	(void)state;
	static const double targets[] = {0.2, 0.9}, factors[] = {0, 5, 2.5};
	static const double stops[][2] = {{0.08, 0.2}, {0.04, 0.1}, {0.08, 0.2}};
	struct plan p = {.kind = PLAN_SAMPLES, .groups = 16, .epoch = 1, .crop_width = 10, .crop_height = 10};
	for (int rule = 0; rule < 3; rule++)
		for (int i = 0; i < 2; i++) {
			struct forecast_history h = make_doubtful_history(factors[rule], 0);
			struct forecast_cost c, fresh;
			double stop = forecast_stopping_error(&h, &p, targets[i]);
			double alone = 20000 / (stops[rule][i] * stops[rule][i]),
			       want = fmax(alone, h.looks[h.count - 1].work);
			assert_true(fabs(stop / stops[rule][i] - 1) < 1e-9);
			assert_true(forecast_cost_of_target(&h, &p, targets[i], FORECAST_SAME, &c));
			assert_true(c.work.middle > 0.8 * want && c.work.middle < 1.2 * want);
			/* A new render may have less error than its pilot had. */
			assert_true(forecast_cost_of_target(&h, &p, targets[i], FORECAST_NEW, &fresh));
			assert_true(fresh.work.middle > 0.8 * alone && fresh.work.middle < 1.2 * alone);
			assert_true(fresh.work.low <= c.work.low);
			p.kind = PLAN_CHAINS; /* the doubt of such a render ends */
			assert_true(forecast_stopping_error(&h, &p, targets[i]) == 0);
			p.kind = PLAN_SAMPLES;
			h.looks[h.count - 1].is_doubtful = 0;
			h.looks[h.count - 1].rel_mse_upper = 1.05 * h.looks[h.count - 1].rel_mse;
			assert_true(forecast_stopping_error(&h, &p, targets[i]) == 0);
		}
}

/* The more of a pilot's estimates are in doubt, the longer a render is expected to take; without doubtful ones the
 * forecast is the ordinary one. */
static void doubtful_pilot_raises_the_forecast(void **state)
{
	(void)state;
	struct plan p = {.kind = PLAN_SAMPLES, .groups = 16, .epoch = 1, .crop_width = 10, .crop_height = 10};
	double before = INFINITY;
	struct forecast_history sound = make_doubtful_history(5, 9);
	struct forecast_cost sure;
	assert_true(forecast_cost_of_target(&sound, &p, 0.1, FORECAST_NEW, &sure));
	for (unsigned known = 0; known <= 9; known += 3) {
		struct forecast_history h = make_doubtful_history(5, known);
		struct forecast_cost c;
		assert_true(forecast_cost_of_target(&h, &p, 0.1, FORECAST_NEW, &c));
		printf("%u of 9 looks known: %.2g (%.2g to %.2g), without doubt %.2g\n", known, c.work.middle,
		       c.work.low, c.work.high, sure.work.middle);
		assert_true(c.work.middle <= before && c.work.high >= sure.work.high);
		assert_true(known < 9 || c.work.middle < 1.3 * sure.work.middle);
		/* A multiple of the estimate adds no margin to estimates whose interval is known. */
		assert_true(known < 6 || c.work.low < 1.2 * sure.work.low);
		assert_true(known > 0 || c.work.middle > 15 * sure.work.middle);
		before = c.work.middle;
	}
}

/* A pilot whose doubt ended long after its error was below the target, but long before the pilot did: a new render
 * waits for that end. */
static void doubt_that_ended_late_raises_the_forecast(void **state)
{
	(void)state;
	struct plan p = {.kind = PLAN_SAMPLES, .groups = 16, .epoch = 1, .crop_width = 10, .crop_height = 10};
	struct forecast_history h = {0}, clear = {0};
	for (double work = 1e4; work < 1e8; work *= 1.3) {
		struct forecast_look l = {work, work, work, 1000 / work, 1050 / work, 3000, 0};
		forecast_add_look(&clear, &l);
		l.is_doubtful = work < 1e6;
		forecast_add_look(&h, &l);
	}
	struct forecast_cost c, sure;
	assert_true(forecast_cost_of_target(&h, &p, 0.2, FORECAST_NEW, &c));
	assert_true(forecast_cost_of_target(&clear, &p, 0.2, FORECAST_NEW, &sure));
	printf("in doubt up to 1e6 samples: %.2g (%.2g to %.2g), without doubt %.2g\n", c.work.middle, c.work.low,
	       c.work.high, sure.work.middle);
	assert_true(sure.work.high < 5e4 && c.work.middle > 1e5);
}

/* A pilot whose error fell more slowly once it was far below the target: this says nothing about the target. */
static void estimates_far_below_the_target_do_not_count(void **state)
{
	(void)state;
	struct plan p = {.kind = PLAN_SAMPLES, .groups = 16, .epoch = 1, .crop_width = 10, .crop_height = 10};
	struct forecast_history h = {0}, regular = {0};
	for (double work = 1e4; work < 1e8; work *= 1.3) {
		double error = 1000 / work, slow = error * sqrt(fmax(1, work / 1e6));
		forecast_add_look(&regular, &(struct forecast_look){work, work, work, error, 1.05 * error, 3000, 0});
		forecast_add_look(&h, &(struct forecast_look){work, work, work, slow, 1.05 * slow, 3000, 0});
	}
	struct forecast_cost c, sure;
	assert_true(forecast_cost_of_target(&h, &p, 0.2, FORECAST_NEW, &c));
	assert_true(forecast_cost_of_target(&regular, &p, 0.2, FORECAST_NEW, &sure));
	assert_true(c.work.low == sure.work.low && c.work.high == sure.work.high);
}

static void invalid_estimates_are_ignored(void **state)
{
	(void)state;
	struct forecast_history h = {0};
	struct forecast_range r;
	struct forecast_cost c;
	struct plan p = make_plan(64);
	assert_false(forecast_current_error(&h, &r) || forecast_cost_of_target(&h, &p, 0.1, FORECAST_NEW, &c) ||
		     forecast_cost_of_halving(&h, &p, &c));
	const struct forecast_look none[] = {
		{1, 1, 1, NAN, NAN, 15, 0}, {1, 1, 1, 0, 0, 15, 0},	   {1, 1, 1, INFINITY, INFINITY, 15, 0},
		{1, 1, 1, 2, 1, 15, 0},	    {0, 1, 1, 1, 2, 15, 0},	   {9.9e228, 1, 1, 1, 2, 15, 0},
		{NAN, 1, 1, 1, 2, 15, 0},   {1, INFINITY, 1, 1, 2, 15, 0}, {1, 1, NAN, 1, 2, 15, 0},
		{1, 1, 1, 1, 2, NAN, 0}};
	for (size_t i = 0; i < sizeof none / sizeof *none; i++)
		forecast_add_look(&h, &none[i]);
	assert_int_equal(h.count, 0);
	for (int i = 1; i <= 3 * FORECAST_LOOKS_MAX; i++)
		forecast_add_look(&h, &(struct forecast_look){i, i, i, 1.0 / i, 1.1 / i, 100, 0});
	assert_int_equal(h.count, FORECAST_LOOKS_MAX);
	assert_true(h.looks[FORECAST_LOOKS_MAX - 1].work == 3 * FORECAST_LOOKS_MAX);
	assert_null(forecast_stopping_look(&h, 1e-9));
	assert_ptr_equal(forecast_stopping_look(&h, 10), &h.looks[0]);
	h.looks[0].is_doubtful = 1; /* no render would have ended at it */
	assert_ptr_equal(forecast_stopping_look(&h, 10), &h.looks[1]);
	/* A target out of reach is reported as such, without computing. */
	assert_true(forecast_cost_of_target(&h, &p, 1e-200, FORECAST_SAME, &c) && isinf(c.work.low));
}

static void history_survives_json(void **state)
{
	(void)state;
	struct dice d = dice_for_test("forecast looks_travel_as_json");
	struct forecast_history h = simulate_pilot(77, 3000, 30, &d), back;
	json_t *list = forecast_looks_to_json(&h);
	forecast_looks_from_json(list, &back);
	json_decref(list);
	assert_int_equal(back.count, h.count);
	for (uint32_t i = 0; i < h.count; i++)
		assert_true(back.looks[i].rel_mse == h.looks[i].rel_mse &&
			    back.looks[i].seconds == h.looks[i].seconds &&
			    back.looks[i].cpu_seconds == h.looks[i].cpu_seconds &&
			    back.looks[i].degrees == h.looks[i].degrees &&
			    back.looks[i].is_doubtful == h.looks[i].is_doubtful &&
			    back.looks[i].rel_mse_upper == h.looks[i].rel_mse_upper &&
			    back.looks[i].work == h.looks[i].work);
	forecast_looks_from_json(NULL, &back);
	assert_int_equal(back.count, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(forecast_intervals_hold),
		cmocka_unit_test(forecast_intervals_from_own_estimates_hold),
		cmocka_unit_test(forecast_stops_are_rounds_with_an_estimate),
		cmocka_unit_test(halving_the_error_costs_three_times_the_work_done),
		cmocka_unit_test(slower_convergence_raises_the_forecast),
		cmocka_unit_test(invalid_estimates_are_ignored),
		cmocka_unit_test(history_survives_json),
		cmocka_unit_test(doubtful_render_stops_well_below_the_target),
		cmocka_unit_test(doubt_that_ended_late_raises_the_forecast),
		cmocka_unit_test(estimates_far_below_the_target_do_not_count),
		cmocka_unit_test(doubtful_pilot_raises_the_forecast),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
