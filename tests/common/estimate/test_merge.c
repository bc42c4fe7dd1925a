/* SPDX-License-Identifier: Apache-2.0 */
/* When the error is estimated, and what stopping by it does: the ladder of rounds, and renders that stop at their
 * targets. */
#include "common/base/mem.h"
#include "common/estimate/merge.h"
#include "tests/support/dice.h"
#include "tests/support/group_image.h"
#include "tests/support/test_length.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

static struct plan make_plan(uint32_t width, uint32_t height, uint64_t epoch)
{
	struct plan p = group_image_plan(PLAN_SAMPLES, width, height);
	p.epoch = epoch;
	p.seconds = 0;
	p.target_error = 0.1;
	return p;
}

static void estimates_are_due_at_a_geometric_ladder_of_rounds(void **state)
{
	(void)state;
	static const uint64_t ladder[] = {1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 15, 18, 22, 27, 33, 41};
	struct plan p = make_plan(30, 20, 4); /* 64 samples per pixel and round */
	uint64_t r = 0;
	for (size_t i = 0; i < sizeof ladder / sizeof *ladder; i++) {
		r = merge_next_error_rounds(&p, r);
		assert_int_equal(r, ladder[i]);
	}
	for (uint64_t k = 1; k <= 40; k++) {
		bool on = false;
		for (size_t i = 0; i < sizeof ladder / sizeof *ladder; i++)
			on |= ladder[i] == k;
		assert_int_equal(merge_error_is_due(&p, k), on);
	}
	assert_false(merge_error_is_due(&p, 0));
	p.target_error = 0;
	assert_false(merge_error_is_due(&p, 1));
}

/* A black image ends, after a million samples at least, if only an error bounds it. */
static void black_image_ends_after_a_million_samples(void **state)
{
	(void)state;
	struct plan p = make_plan(30, 20, 4), q; /* 38,400 samples a round, of a film without a border */
	struct canvas_image img = {.is_black = true, .rel_mse = NAN, .rel_mse_upper = NAN};
	p.rounds = UINT64_MAX;
	p.border = 0;
	assert_int_equal(merge_find_end(&p, 26, 0, &img), MERGE_CONTINUES);
	assert_int_equal(merge_find_end(&p, 27, 0, NULL), MERGE_CONTINUES);
	assert_int_equal(merge_find_end(&p, 27, 0, &img), MERGE_BLACK);
	assert_string_equal(merge_end_name(MERGE_BLACK, false), "black");
	q = p;
	q.seconds = 10;
	assert_int_equal(merge_find_end(&q, 27, 5, &img), MERGE_CONTINUES);
	q = p;
	q.rounds = 100;
	assert_int_equal(merge_find_end(&q, 27, 0, &img), MERGE_CONTINUES);
	q = p;
	q.kind = PLAN_CHAINS;
	q.chains = 100;
	assert_int_equal(merge_find_end(&q, 1000000, 0, &img), MERGE_CONTINUES);
	img.is_black = false;
	assert_int_equal(merge_find_end(&p, 27, 0, &img), MERGE_CONTINUES);
}

/* At least 0.9 mutations per pixel and group between two estimates, however long the plan's rounds are; and, from four
 * rounds on, steps of a quarter or less. */
static void estimates_are_a_minimum_of_work_apart(void **state)
{
	(void)state;
	for (uint32_t groups = 2; groups <= 64; groups *= 2)
		for (uint64_t epoch = 1; epoch < 1000; epoch = epoch * 5 / 2 + 1) {
			struct plan p = make_plan(100, 50, 1);
			p.kind = PLAN_CHAINS;
			p.groups = groups;
			p.chains = groups * 8;
			p.epoch = epoch;
			uint64_t previous = 0, round = plan_round_mutations(&p);
			for (int i = 0; i < 60; i++) {
				uint64_t r = merge_next_error_rounds(&p, previous);
				assert_true(r > previous && (double)((r - previous) * round) >= 0.9 * groups * 5000);
				assert_true(i < 4 || (double)r <= 1.25 * (double)previous);
				assert_true(r - previous <= (groups * 4500 + round - 1) / round ||
					    (double)(r - previous) >= 0.15 * (double)previous);
				previous = r;
			}
		}
	struct plan p = make_plan(100, 50, 1);
	assert_true(merge_next_error_rounds(&p, UINT64_MAX - 1) == UINT64_MAX &&
		    merge_next_error_rounds(&p, UINT64_MAX / 4) > UINT64_MAX / 4);
}

/* A render whose pixels have errors of their own and one in common: sums of a group and round of `epoch` samples. */
struct noisy_render {
	double pixel_deviation, common_deviation;
	struct dice dice;
};

static struct batch make_batch(struct noisy_render *r, const struct plan *p, uint64_t round, uint32_t group)
{
	struct batch b = {
		.key = {1, LEASE_RENDER, group, 0, round}, .tile_count = 1, .tiles = mem_alloc(1, sizeof *b.tiles)};
	double n = (double)p->epoch, together = r->common_deviation * dice_normal(&r->dice);
	b.tiles[0] =
		(struct tile){0, 0, p->width, p->height, mem_alloc((size_t)p->width * p->height * 3, sizeof(float))};
	for (size_t i = 0; i < (size_t)p->width * p->height; i++) {
		float v = (float)(n + sqrt(n) * (together + r->pixel_deviation * dice_normal(&r->dice)));
		for (size_t k = 0; k < 3; k++)
			b.tiles[0].xyz[3 * i + k] = v;
	}
	b.counters[COUNT_SAMPLES] = p->epoch * p->width * p->height;
	return b;
}

static double realised_error(const struct canvas_image *img)
{
	static const double white[3] = {3.2404541621141054 - 1.5371385127977166 - 0.4985314095560162,
					-0.9692660305051868 + 1.8760108454466942 + 0.0415560175303498,
					0.0556434309591147 - 0.2040259135167538 + 1.0572251882231791};
	double sum = 0;
	size_t pixels = (size_t)img->width * img->height;
	for (size_t i = 0; i < pixels * 3; i++)
		sum += pow((double)img->rgb[i] / white[i % 3] - 1, 2);
	return sum / (double)pixels / 3;
}

struct stop {
	uint64_t rounds;
	double error;
};

static struct stop render_until_stop(const struct plan *p, struct noisy_render *r)
{
	struct canvas *c;
	struct stop s = {0};
	assert_int_equal(canvas_new(&c, p, -20, NULL, NULL), 0);
	for (uint64_t round = 0; !s.rounds; round++) {
		for (uint32_t g = 0; g < p->groups; g++) {
			struct batch b = make_batch(r, p, round, g);
			assert_int_equal(canvas_add(c, &b, NULL), 0);
			batch_fini(&b);
		}
		if (!merge_error_is_due(p, round + 1))
			continue;
		struct canvas_image img;
		assert_int_equal(canvas_image_init(c, false, &img, NULL), 0);
		if (merge_find_end(p, round + 1, 0, &img) == MERGE_ERROR)
			s = (struct stop){round + 1, sqrt(realised_error(&img)) / p->target_error};
		canvas_image_fini(&img);
	}
	canvas_free(c);
	return s;
}

static int compare_ascending(const void *a, const void *b)
{
	double x = *(const double *)a, y = *(const double *)b;
	return (x > y) - (x < y);
}

/*
 * 300 renders each, stopped at a target that needs 7 rounds or more. Printed: the share whose error is above the target
 * at the stop, its median over the target, and the rounds. The share is 15 to 20 % in all cases, near that of a single
 * estimate when one error is common to all pixels (the error of one render is then the magnitude of one normal deviate,
 * which no rule can know); where many pixels have errors of their own the 15 % are above the target by about 2 %,
 * because there the upper end is close to the estimate. So a second estimate that confirms the first would gain
 * nothing. Level: binomial; a share of 20 % exceeds the limit of 33 % of 300 with a probability of 1e-7. Power: without
 * the interval (the estimate against the target) the share is above 40 % in all cases, found with more than 99 %.
 */
static void stops_are_seldom_above_the_target(void **state)
{
	(void)state;
	enum { RUNS = 300 };
	const int runs = test_is_scaled() ? RUNS / 5 : RUNS;
	static const struct {
		const char *name;
		uint32_t side;
		double each, common, target;
	} cases[] = {{"pixels by themselves", 16, 1, 0, 0.03},
		     {"a few of them", 3, 1, 0, 0.03},
		     {"half in common", 8, 0.7, 0.7, 0.03},
		     {"all in common", 2, 0, 1, 0.03}};
	struct noisy_render r = {.dice = dice_for_test("stops_are_not_lucky_dips")};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct plan p = make_plan(cases[i].side, cases[i].side, 10);
		p.target_error = cases[i].target;
		r.pixel_deviation = cases[i].each;
		r.common_deviation = cases[i].common;
		double error[RUNS], above = 0, rounds = 0;
		for (int k = 0; k < runs; k++) {
			struct stop s = render_until_stop(&p, &r);
			error[k] = s.error;
			above += s.error > 1;
			rounds += (double)s.rounds / runs;
		}
		qsort(error, (size_t)runs, sizeof *error, compare_ascending);
		print_message(
			"%s: %.1f %% above the target, error over target: median %.3f, 95 %% below %.3f; %.1f rounds\n",
			cases[i].name, 100 * above / runs, error[runs / 2], error[runs - runs / 20], rounds);
		assert_true(error[runs / 2] < 1.0);
		assert_true(test_is_scaled() || above <= 0.33 * runs);
	}
}

/* Against a clock that completes rounds one by one: the render ends at the first round that completes after its time
 * limit. */
static void time_limit_ends_a_render_with_a_full_round(void **state)
{
	(void)state;
	struct dice d = dice_for_test("time left");
	for (int i = 0; i < 20000; i++) {
		struct plan p = {.seconds = 100 * dice_uniform(&d)};
		double round = exp(8 * dice_uniform(&d) - 4), bootstrap = 20 * dice_uniform(&d),
		       now = 150 * dice_uniform(&d);
		double end = bootstrap + round;
		while (end < p.seconds || end < now)
			end += round;
		double remaining = merge_seconds_remaining(&p, now, (now - bootstrap) / round, 1 / round);
		/* the clock adds up rounding errors: at its beats, one round more or less is equally correct */
		double wrong = fabs(remaining - (end - now)) / round;
		assert_true(wrong < 1e-6 || fabs(wrong - 1) < 1e-6);
		if (wrong > 0.5)
			assert_true(fabs(end - p.seconds) < 1e-6 * round ||
				    fabs(end - round - p.seconds) < 1e-6 * round || fabs(end - now) < 1e-6 * round ||
				    fabs(end - round - now) < 1e-6 * round);
	}
	struct plan p = {.seconds = 10};
	assert_true(merge_seconds_remaining(&p, 4, 0.5, 0) == 6);
	assert_true(isnan(merge_seconds_remaining(&p, 11, 0.5, 0)));
	assert_true(merge_seconds_remaining(&p, 11, 0.5, 0.25) == 2);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(estimates_are_due_at_a_geometric_ladder_of_rounds),
		cmocka_unit_test(black_image_ends_after_a_million_samples),
		cmocka_unit_test(estimates_are_a_minimum_of_work_apart),
		cmocka_unit_test(stops_are_seldom_above_the_target),
		cmocka_unit_test(time_limit_ends_a_render_with_a_full_round),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
