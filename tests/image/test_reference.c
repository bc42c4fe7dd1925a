/* SPDX-License-Identifier: Apache-2.0 */
/*
 * `path` against another renderer's reference images, if HSLT_SCENES names the folder of public scenes.
 *
 * The references are of an RGB renderer, so colours are compared with `colour=rgb`: all three channels, and their
 * means. With spectra, light that meets saturated walls several times has another colour, since the product of smooth
 * spectra is not the product of their RGB triples; so of a spectral picture only the luminance is compared, for one
 * scene, and with FULL=1 also for the other.
 *
 * The references were filtered at their own size, so this test renders at their size, with the scene's filter, and
 * averages both to a width of 256 pixels: at least 128 samples per compared pixel, FULL=1: 256. HSLT_TEST_SCALE=N takes
 * N times fewer, for one picture, and only prints the figures: most of the difference is then noise, and four times the
 * samples give a quarter of it.
 */
#include "common/base/color.h"
#include "tests/support/test_length.h"
#include "tests/support/render_picture.h"
#include "tests/support/worlds.h"
#include "worker/cli/image/compare.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

enum { WIDTH = 256 };
static const double mean_tolerance = 0.03, trim = 0.001;

/* Samples for each pixel that is compared, and the relMSE that is allowed with them, most of which is noise. */
static uint32_t samples_per_pixel(void)
{
	return test_is_full() ? 256 : 128;
}

static double max_rel_mse(void)
{
	return 2.56 / samples_per_pixel();
}

struct subject {
	const char *folder;
	uint32_t max_depth; /* 0: as in the scene */
};

/* Means of equal boxes, WIDTH of them per row. */
static void shrink_picture(struct picture *p)
{
	struct error e = {""};
	assert_int_equal(p->image.width % WIDTH, 0);
	if (picture_shrink(p, WIDTH, p->image.height / (p->image.width / WIDTH), &e))
		fail_msg("%s", e.text);
}

static void read_reference(const char *folder, struct picture *p)
{
	struct error e = {""};
	char path[4096];
	snprintf(path, sizeof path, "%s/%s/TungstenRender.exr", getenv("HSLT_SCENES"), folder);
	if (picture_read(p, path, &e))
		fail_msg("%s", e.text);
	shrink_picture(p);
}

static void render_xyz(const struct world *w, const struct subject *s, uint64_t divisor, struct picture *xyz)
{
	uint32_t box = w->settings.width / WIDTH;
	uint64_t samples_per_box_pixel = (samples_per_pixel() + box * box - 1) / (box * box),
		 spp = samples_per_box_pixel / (divisor * test_scale());
	struct render_picture_options options = {"path", s->folder, spp ? spp : 1, s->max_depth};
	render_picture_xyz(w, &options, xyz);
	shrink_picture(xyz);
}

/* accuracy: NULL, or a setting other than the default. */
static void render_rgb(const struct subject *s, const char *accuracy, uint64_t divisor, struct picture *rgb)
{
	worlds_accuracy = accuracy;
	struct world *w = world_from_public_scene(s->folder, "scene.xml", 0, 0);
	worlds_accuracy = NULL;
	render_xyz(w, s, divisor, rgb);
	world_free(w);
	for (size_t i = 0; i < (size_t)rgb->image.width * rgb->image.height; i++) {
		double xyz[3] = {(double)rgb->rgb[0][i], (double)rgb->rgb[1][i], (double)rgb->rgb[2][i]}, to[3];
		rec709_from_xyz(xyz, to);
		for (int c = 0; c < 3; c++)
			rgb->image.planes[c][i] = (float)to[c];
	}
}

/* Prints the comparison; label: names the pictures. */
static struct compare_result compare_pictures(const struct picture *rendered, const struct picture *reference,
					      const struct subject *s, const char *label)
{
	struct compare_result untrimmed, r;
	struct error e = {""};
	if (compare_to_reference(rendered, reference, 0, &untrimmed, &e) ||
	    compare_to_reference(rendered, reference, trim, &r, &e))
		fail_msg("%s", e.text);
	print_message("%s, %s: mean luminance x %.4f, relMSE %.4f, trimmed %.4f\n", s->folder, label, r.luminance_ratio,
		      untrimmed.rel_mse, r.rel_mse);
	return r;
}

static void check_result(const struct compare_result *r)
{
	if (test_is_scaled())
		return;
	assert_true(fabs(r->luminance_ratio - 1) <= mean_tolerance);
	assert_true(r->rel_mse <= max_rel_mse());
}

/* Replaces all channels by the luminance, so that errors over three channels are those of one. */
static void replace_by_luminance(struct picture *p)
{
	for (size_t i = 0; i < (size_t)p->image.width * p->image.height; i++) {
		double y =
			0.2126 * (double)p->rgb[0][i] + 0.7152 * (double)p->rgb[1][i] + 0.0722 * (double)p->rgb[2][i];
		for (int c = 0; c < 3; c++)
			p->image.planes[c][i] = (float)y;
	}
}

static void skip_without_scenes(void)
{
	if (getenv("HSLT_SCENES"))
		return;
	print_message("skipped: HSLT_SCENES names no folder of public scenes\n");
	skip();
}

static void compare_in_rgb(const struct subject *s)
{
	static const double channel_tolerance = 0.002; /* about seven standard errors of a mean */
	skip_without_scenes();
	struct picture rendered, reference;
	read_reference(s->folder, &reference);
	render_rgb(s, "colour=rgb", 1, &rendered);
	struct compare_result r = compare_pictures(&rendered, &reference, s, "rgb");
	picture_fini(&rendered);
	picture_fini(&reference);
	check_result(&r);
	for (int c = 0; c < 3; c++) {
		print_message("channel %d: mean x %.5f\n", c, r.mean_a[c] / r.mean_b[c]);
		assert_true(test_is_scaled() || fabs(r.mean_a[c] / r.mean_b[c] - 1) <= channel_tolerance);
	}
}

static void compare_in_colour(const struct subject *s)
{
	skip_without_scenes();
	struct picture rendered, reference;
	read_reference(s->folder, &reference);
	render_rgb(s, NULL, 1, &rendered);
	compare_pictures(&rendered, &reference, s,
			 "spectral, all of it (not tested: an RGB renderer has other colours)");
	replace_by_luminance(&rendered);
	replace_by_luminance(&reference);
	struct compare_result r = compare_pictures(&rendered, &reference, s, "spectral, luminance");
	picture_fini(&rendered);
	picture_fini(&reference);
	check_result(&r);
}

static const struct subject cornell_box = {"cornell-box", 0};

static void cornell_box_in_rgb(void **state)
{
	(void)state;
	compare_in_rgb(&cornell_box);
}

static void cornell_box_in_colour(void **state)
{
	(void)state;
	compare_in_colour(&cornell_box);
}

/* The scene says maxDepth 5, but its reference shows direct light only: the plates do not reflect the lit wall and
 * floor. With paths of two edges the pictures agree. */
static const struct subject veach_mis = {"veach-mis", 2}, veach_mis_as_written = {"veach-mis", 0};

static void veach_mis_in_rgb(void **state)
{
	(void)state;
	compare_in_rgb(&veach_mis);
}

static void veach_mis_in_colour(void **state)
{
	(void)state;
	compare_in_colour(&veach_mis);
	struct picture rendered, reference;
	read_reference(veach_mis.folder, &reference);
	render_rgb(&veach_mis_as_written, NULL, 4, &rendered);
	replace_by_luminance(&rendered);
	replace_by_luminance(&reference);
	compare_pictures(&rendered, &reference, &veach_mis,
			 "spectral, luminance, at the scene's own depth (not tested: the reference is direct light)");
	picture_fini(&rendered);
	picture_fini(&reference);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(cornell_box_in_colour),
		cmocka_unit_test(cornell_box_in_rgb),
		cmocka_unit_test(veach_mis_in_rgb),
		cmocka_unit_test(veach_mis_in_colour),
	};
	size_t count = sizeof tests / sizeof *tests;
	return _cmocka_run_group_tests("reference", tests,
				       test_is_scaled() ? 1
				       : test_is_full() ? count
							: count - 1,
				       NULL, NULL);
}
