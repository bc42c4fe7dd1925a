/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Errors of single pixels, on groups whose truth is known. The error of a pixel that rare light did not reach is as
 * large as the light that it misses, but only where such light may come; pixels that no chain visited are counted and
 * have an error.
 */
#include "common/estimate/merge.h"
#include "common/estimate/stated_error.h"
#include "common/exr/header.h"
#include "tests/support/dice.h"
#include "tests/support/group_image.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

enum { WIDTH = 16, HEIGHT = 8, PIXELS = WIDTH * HEIGHT };

/* A wall known to 2 %, plus as much light again that comes with one sample of a group in `hits_per_group`. */
struct rare_light_model {
	struct dice d;
	double hits_per_group;
};

static double rare_light(void *user, uint32_t group, uint32_t pixel)
{
	struct rare_light_model *r = user;
	(void)group;
	(void)pixel;
	return 1 + 0.02 * dice_normal(&r->d) + dice_poisson(&r->d, r->hits_per_group) / r->hits_per_group;
}

/* Over 50 pictures, from column `first` on: *outlier_share is the share of values more than three errors from the
 * truth, *ratio the mean squared error over the mean squared deviation. */
static void compare_with_truth(group_image_value *value, struct rare_light_model *r, double truth, uint32_t first,
			       double *outlier_share, double *ratio)
{
	struct plan p = group_image_plan(PLAN_SAMPLES, WIDTH, HEIGHT);
	double stated = 0, realised = 0, values = 3. * (WIDTH - first) * HEIGHT * 50;
	*outlier_share = 0;
	for (int picture = 0; picture < 50; picture++) {
		struct canvas_image img;
		group_image_make(&p, value, r, &img);
		for (uint32_t i = 0; i < 3 * PIXELS; i++) {
			double deviation = (double)img.rgb[i] - truth, error = (double)img.error[i];
			if (i / 3 % WIDTH < first)
				continue;
			*outlier_share += (fabs(deviation) > 3 * error) / values;
			stated += error * error;
			realised += deviation * deviation;
		}
		canvas_image_fini(&img);
	}
	*ratio = stated / realised;
}

static void compare_rare_light(double hits_per_group, double *outlier_share, double *ratio)
{
	struct rare_light_model r = {.d = dice_for_test("rare light"), .hits_per_group = hits_per_group};
	compare_with_truth(rare_light, &r, 2, 0, outlier_share, ratio);
}

/*
 * With a quarter of a hit per pixel, three of four pixels look certain and miss half of their light. Without their
 * neighbours' errors 70 % of the values would be more than three errors from the truth; Student's t with 15 degrees of
 * freedom has 0.9 %. With 40 hits in every group the errors are those of the groups alone: 19,200 values (6,400
 * independent ones, because colours are correlated) determine the ratio of the squares to 1.8 %, so 6 % is three
 * standard errors.
 */
static void pixel_errors_include_rare_light(void **state)
{
	double outlier_share, ratio;
	(void)state;
	compare_rare_light(1. / 64, &outlier_share, &ratio);
	print_message("rare light: %.2f %% beyond three errors, squares %.2f of the truth\n", 100 * outlier_share,
		      ratio);
	assert_true(outlier_share < 0.02 && ratio > 0.9 && ratio < 1.2);
	compare_rare_light(40, &outlier_share, &ratio);
	print_message("frequent light: %.2f %% beyond three errors, squares %.3f of the truth\n", 100 * outlier_share,
		      ratio);
	assert_true(outlier_share < 0.02 && fabs(ratio - 1) < 0.06);
}

/*
 * Two columns of a highlight, with a firefly in a quarter of its pixels, beside a wall a hundred times darker and known
 * to 2 %: the wall's errors must be its own. 14,336 values of 4,779 independent pixels determine the ratio of the
 * squares to 3 %, including the spread of the errors (15 degrees of freedom); if the highlight's rare light counted for
 * the wall, the ratio would be above 100.
 */
static double value_beside_highlight(void *user, uint32_t group, uint32_t pixel)
{
	struct rare_light_model *r = user;
	return pixel % WIDTH < 2 ? 100 * rare_light(user, group, pixel) : 1 + 0.02 * dice_normal(&r->d);
}

static void highlight_does_not_raise_errors_beside_it(void **state)
{
	struct rare_light_model r = {.d = dice_for_test("highlight"), .hits_per_group = 1. / 64};
	double outlier_share, ratio;
	(void)state;
	/* from column 3 on: neighbours of unreliable pixels share some of their variance */
	compare_with_truth(value_beside_highlight, &r, 1, 3, &outlier_share, &ratio);
	print_message("beside a highlight: squares %.3f of the truth\n", ratio);
	assert_true(fabs(ratio - 1) < 0.15);
}

/* ---- tiles that no chain visited ---- */

static double half_visited_value(void *user, uint32_t group, uint32_t pixel)
{
	(void)user;
	return pixel % WIDTH < 9 ? 1 + 0.1 * (group % 4) : 0;
}

static void unvisited_pixels_are_counted(void **state)
{
	(void)state;
	struct plan p = group_image_plan(PLAN_CHAINS, WIDTH, HEIGHT);
	struct canvas_image img;
	char text[STATED_ERROR_TEXT_MAX];
	group_image_make(&p, half_visited_value, NULL, &img);
	assert_int_equal(img.unvisited_count, 7 * HEIGHT);
	for (uint32_t i = 0; i < 3 * PIXELS; i++)
		assert_true(img.error[i] > 0);
	stated_error_print(&img, text, sizeof text);
	assert_non_null(strstr(text, "no chain reached 56 of 128 pixels"));
	static struct header h;
	header_fill(&h, &img, &p, &(struct header_extra){.scene = "test.xml", .date = ""});
	bool counted = false, defined = false;
	for (size_t i = 0; i < h.count; i++) {
		counted |= strcmp(h.attributes[i].name, "hslt:unvisitedPixels") == 0 &&
			   strcmp(h.attributes[i].string, "56") == 0;
		defined |= strcmp(h.attributes[i].name, "hslt:relMSEDefinition") == 0;
	}
	assert_true(counted && defined);
	canvas_image_fini(&img);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(pixel_errors_include_rare_light),
		cmocka_unit_test(highlight_does_not_raise_errors_beside_it),
		cmocka_unit_test(unvisited_pixels_are_counted),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
