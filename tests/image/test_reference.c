/* SPDX-License-Identifier: Apache-2.0 */
/*
 * `path` against reference images of another renderer, where HSLT_SCENES names the folder of public scenes.
 *
 * The references are of an RGB renderer. Light that meets saturated walls several times has another colour there than
 * here: the product of smooth spectra is not the product of their RGB triples. That is no error of transport, so
 * transport is compared like with like: the scene is rendered in grey, with every colour replaced by its green channel
 * (FULL=1: by each of its channels in turn). A grey scene carries no wavelengths and multiplies numbers, as an RGB
 * renderer does. Of the spectral picture the luminance is compared, of one scene, and with FULL=1 of the other.
 *
 * The references were filtered at their own size, so this renders at their size, with the scene's filter, and averages
 * both to 256 pixels wide: at least 128 samples a pixel that is compared, FULL=1: 256. With HSLT_TEST_SCALE=N there
 * are N times fewer, of one picture, and figures are only printed: most of what is left is noise, four times the
 * samples give a quarter of it.
 */
#include "common/base/color.h"
#include "tests/support/length.h"
#include "tests/support/memory_assets.h"
#include "tests/support/render_picture.h"
#include "tests/support/worlds.h"
#include "worker/cli/image/compare.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { WIDTH = 256 };
static const double mean_tolerance = 0.03, trim = 0.001;

/* Of each pixel that is compared, and the relMSE that is allowed with them, most of which is noise. */
static uint32_t samples(void)
{
	return test_full() ? 256 : 128;
}

static double most_rel_mse(void)
{
	return 2.56 / samples();
}

struct subject {
	const char *folder;
	uint32_t max_depth; /* 0: the scene's */
};

static char *scene_text(const char *folder)
{
	char path[4096];
	snprintf(path, sizeof path, "%s/%s/scene.xml", getenv("HSLT_SCENES"), folder);
	FILE *f = fopen(path, "rb");
	if (!f)
		fail_msg("%s does not open", path);
	enum { LIMIT = 1 << 20 };
	char *text = calloc(1, LIMIT);
	assert_non_null(text);
	assert_true(fread(text, 1, LIMIT - 1, f) > 0 && feof(f));
	fclose(f);
	return text;
}

/* In place: value="r, g, b" of each <rgb> becomes value="g    ". */
static int make_grey(char *text, int channel)
{
	static const char key[] = "value=\"";
	int count = 0;
	for (char *at = strstr(text, "<rgb"); at; at = strstr(at, "<rgb"), count++) {
		at = strstr(at, key);
		assert_non_null(at);
		at += strlen(key);
		size_t length = strcspn(at, "\"");
		char *p = at;
		for (int c = 0; c < channel; c++) {
			p += strcspn(p, ", \"");
			p += strspn(p, ", ");
		}
		size_t digits = strcspn(p, ", \"");
		assert_true(digits > 0 && p + digits <= at + length);
		memmove(at, p, digits);
		memset(at + digits, ' ', length - digits);
	}
	return count;
}

static struct world *grey_world(const char *folder, int channel)
{
	char *text = scene_text(folder);
	assert_true(make_grey(text, channel) > 0);
	const struct memory_file files[] = {{"scene.xml", text, strlen(text)}, {NULL, NULL, 0}};
	struct world *w = world_of_files(0, 0, files);
	free(text);
	assert_false(w->effects.colour);
	return w;
}

/* Means of equal boxes, WIDTH of them in a row. */
static void shrink(struct picture *p)
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
	shrink(p);
}

static void render(const struct world *w, const struct subject *s, uint64_t fewer, struct picture *xyz)
{
	uint32_t box = w->settings.width / WIDTH;
	uint64_t full = (samples() + box * box - 1) / (box * box), spp = full / (fewer * test_scale());
	struct render_picture_how how = {"path", s->folder, spp ? spp : 1, s->max_depth};
	render_picture_xyz(w, &how, xyz);
	shrink(xyz);
}

/* With every colour replaced by that channel of it: one number a pixel, in all three planes. */
static void render_in_grey(const struct subject *s, int channel, struct picture *p)
{
	struct world *w = grey_world(s->folder, channel);
	render(w, s, 1, p);
	for (size_t i = 0; i < (size_t)p->image.width * p->image.height; i++) {
		float value = (float)((double)p->rgb[1][i] / w->grey_xyz[1]);
		for (int c = 0; c < 3; c++)
			p->image.planes[c][i] = value;
	}
	world_free(w);
}

static void render_in_colour(const struct subject *s, uint64_t fewer, struct picture *rgb)
{
	struct world *w = world_of_public_scene(s->folder, "scene.xml", 0, 0);
	render(w, s, fewer, rgb);
	world_free(w);
	for (size_t i = 0; i < (size_t)rgb->image.width * rgb->image.height; i++) {
		double from[3] = {(double)rgb->rgb[0][i], (double)rgb->rgb[1][i], (double)rgb->rgb[2][i]}, to[3];
		rec709_from_xyz(from, to);
		for (int c = 0; c < 3; c++)
			rgb->image.planes[c][i] = (float)to[c];
	}
}

/* Prints; what: of which pictures. */
static struct compare_result measure(const struct picture *ours, const struct picture *reference,
				     const struct subject *s, const char *what)
{
	struct compare_result all, r;
	struct error e = {""};
	if (compare(ours, reference, 0, &all, &e) || compare(ours, reference, trim, &r, &e))
		fail_msg("%s", e.text);
	print_message("%s, %s: mean luminance x %.4f, relMSE %.4f, trimmed %.4f\n", s->folder, what, r.luminance_ratio,
		      all.rel_mse, r.rel_mse);
	return r;
}

static void check_result(const struct compare_result *r)
{
	if (test_scaled())
		return;
	assert_true(fabs(r->luminance_ratio - 1) <= mean_tolerance);
	assert_true(r->rel_mse <= most_rel_mse());
}

/* All channels become the luminance: errors over three channels are then those of one. */
static void keep_luminance(struct picture *p)
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

static void compare_in_grey(const struct subject *s)
{
	static const char *const names[] = {"red in grey", "green in grey", "blue in grey"};
	skip_without_scenes();
	for (int channel = test_full() ? 0 : 1; channel < (test_full() ? 3 : 2); channel++) {
		struct picture ours, reference;
		read_reference(s->folder, &reference);
		for (int c = 0; c < 3; c++)
			if (c != channel)
				memcpy(reference.image.planes[c], reference.image.planes[channel],
				       (size_t)reference.image.width * reference.image.height * sizeof(float));
		render_in_grey(s, channel, &ours);
		struct compare_result r = measure(&ours, &reference, s, names[channel]);
		picture_fini(&ours);
		picture_fini(&reference);
		check_result(&r);
	}
}

static void compare_in_colour(const struct subject *s)
{
	skip_without_scenes();
	struct picture ours, reference;
	read_reference(s->folder, &reference);
	render_in_colour(s, 1, &ours);
	measure(&ours, &reference, s, "spectral, all of it (not tested: an RGB renderer has other colours)");
	keep_luminance(&ours);
	keep_luminance(&reference);
	struct compare_result r = measure(&ours, &reference, s, "spectral, luminance");
	picture_fini(&ours);
	picture_fini(&reference);
	check_result(&r);
}

static const struct subject cornell_box = {"cornell-box", 0};

static void cornell_box_in_grey(void **state)
{
	(void)state;
	compare_in_grey(&cornell_box);
}

static void cornell_box_in_colour(void **state)
{
	(void)state;
	compare_in_colour(&cornell_box);
}

/* The scene says maxDepth 5, but its reference shows direct light only: its plates do not mirror the lit wall and
 * floor. At two edges the pictures agree. */
static const struct subject veach_mis = {"veach-mis", 2}, veach_mis_as_written = {"veach-mis", 0};

static void veach_mis_in_grey(void **state)
{
	(void)state;
	compare_in_grey(&veach_mis);
}

static void veach_mis_in_colour(void **state)
{
	(void)state;
	compare_in_colour(&veach_mis);
	struct picture ours, reference;
	read_reference(veach_mis.folder, &reference);
	render_in_colour(&veach_mis_as_written, 4, &ours);
	keep_luminance(&ours);
	keep_luminance(&reference);
	measure(&ours, &reference, &veach_mis,
		"spectral, luminance, at the scene's own depth (not tested: the reference is direct light)");
	picture_fini(&ours);
	picture_fini(&reference);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(cornell_box_in_colour),
		cmocka_unit_test(cornell_box_in_grey),
		cmocka_unit_test(veach_mis_in_grey),
		cmocka_unit_test(veach_mis_in_colour),
	};
	size_t count = sizeof tests / sizeof *tests;
	return _cmocka_run_group_tests("reference", tests,
				       test_scaled() ? 1
				       : test_full() ? count
						     : count - 1,
				       NULL, NULL);
}
