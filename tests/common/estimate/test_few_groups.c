/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What an image states about its own error when it has few groups.
 *
 * - A pixel in which one group outweighs the others is doubtful with any number of groups from five on. The pixel is
 *   chosen so that a limit of 0.6 times the number of groups on the kurtosis, which is the limit for 16, would find it
 *   with 16 groups only.
 * - Two hits of a firefly do not make a highlight, three do, with any number of groups that could tell: with eight, two
 *   hits are 1.53 standard errors high, a height that takes three hits with 16 groups.
 * - With four groups, pictures of few pixels state no interval, and those of many do if their errors have a variance:
 *   of 50 pictures whose errors have none at most 10 state one. If a fifth did by chance, 10 would be the mean; the
 *   seeds are fixed: 5 do, and 49 without the doubt about tails.
 */
#include "common/estimate/canvas_image.h"
#include "common/estimate/stated_error.h"
#include "tests/support/dice.h"
#include "tests/support/group_image.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

enum { WIDTH = 16, HEIGHT = 8, PIXELS = WIDTH * HEIGHT, LIT_PIXEL = 45 };

static struct plan make_plan(uint32_t groups, uint32_t width, uint32_t height)
{
	struct plan p = group_image_plan(PLAN_SAMPLES, width, height);
	p.groups = groups;
	p.bootstrap = groups;
	return p;
}

/* Groups agree to 10 %, except that the first few of them find extra light in one pixel. */
struct extra_light {
	double light[3];
};

static double value_with_extra_light(void *user, uint32_t group, uint32_t pixel)
{
	const struct extra_light *f = user;
	double sign = (group + pixel) % 2 ? 1 : -1;
	return 1 + 0.1 * sign + (pixel == LIT_PIXEL && group < 3 ? f->light[group] : 0);
}

static void dominant_group_is_doubtful_with_any_number_of_groups(void **state)
{
	(void)state;
	struct extra_light f = {{100, 40, 0}};
	for (uint32_t groups = 5; groups <= 16; groups++) {
		struct plan p = make_plan(groups, WIDTH, HEIGHT);
		struct canvas_image img;
		group_image_make(&p, value_with_extra_light, &f, &img);
		print_message("%u groups: doubt %d about %.2f\n", groups, (int)img.rel_mse_doubt, img.doubtful_share);
		assert_int_equal(img.rel_mse_doubt, ERROR_DOUBT_ONE_GROUP);
		assert_true(img.doubtful_share > 0.9);
		canvas_image_fini(&img);
	}
}

static double estimated_rel_mse(uint32_t groups, struct extra_light f)
{
	struct plan p = make_plan(groups, WIDTH, HEIGHT);
	struct canvas_image img;
	group_image_make(&p, value_with_extra_light, &f, &img);
	double rel_mse = img.rel_mse;
	canvas_image_fini(&img);
	return rel_mse;
}

static void two_hits_are_no_highlight(void **state)
{
	(void)state;
	for (uint32_t groups = 8; groups <= 16; groups++) {
		double two = PIXELS * estimated_rel_mse(groups, (struct extra_light){{100, 100, 0}}),
		       three = PIXELS * estimated_rel_mse(groups, (struct extra_light){{100, 100, 100}});
		print_message("%u groups: of two hits %.3g, of three %.3g\n", groups, two, three);
		assert_true(two > 10 && three < 0.5);
	}
}

static double grain(void *user, uint32_t group, uint32_t pixel)
{
	(void)group;
	(void)pixel;
	return 1 + 0.3 * dice_normal(user);
}

/* Grain, and a little light that follows a Pareto law of index 1.5, which has no variance. */
static double infinite_variance_light(void *user, uint32_t group, uint32_t pixel)
{
	(void)group;
	(void)pixel;
	return 0.9 + 0.3 * dice_normal(user) + 0.1 / 3 * pow(1 - dice_uniform(user), -1 / 1.5);
}

/* Returns how many of 50 pictures state an interval. */
static int count_stated_intervals(const char *name, group_image_value *value, struct plan p, enum error_doubt *doubt)
{
	struct dice d = dice_for_test(name);
	int count = 0;
	for (int i = 0; i < 50; i++) {
		struct canvas_image img;
		group_image_make(&p, value, &d, &img);
		count += img.rel_mse_doubt == ERROR_DOUBT_NONE;
		*doubt = img.rel_mse_doubt;
		canvas_image_fini(&img);
	}
	print_message("%s, %u groups of %u pixels: %d of 50 stated\n", name, p.groups, p.width * p.height, count);
	return count;
}

static void four_groups_need_many_pixels(void **state)
{
	(void)state;
	char text[STATED_ERROR_TEXT_MAX];
	enum error_doubt doubt;
	assert_int_equal(count_stated_intervals("grain", grain, make_plan(4, 8, 8), &doubt), 0);
	assert_int_equal(doubt, ERROR_DOUBT_FEW_GROUPS);
	stated_error_print(&(struct canvas_image){.rel_mse = 0.01, .rel_mse_doubt = doubt}, text, sizeof text);
	assert_non_null(strstr(text, "relative error about 10 %, its interval is not known: with so few groups"));
	assert_int_equal(count_stated_intervals("grain", grain, make_plan(8, 8, 8), &doubt), 50);
	assert_int_equal(count_stated_intervals("grain", grain, make_plan(4, 64, 32), &doubt), 50);
	assert_true(count_stated_intervals("index 1.5", infinite_variance_light, make_plan(4, 64, 32), &doubt) <= 10);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(dominant_group_is_doubtful_with_any_number_of_groups),
		cmocka_unit_test(two_hits_are_no_highlight),
		cmocka_unit_test(four_groups_need_many_pixels),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
