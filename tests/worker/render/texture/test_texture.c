/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Single textures: the positions of pixels in uv, wrapping, borders, filters, transforms of uv, colours and raw values,
 * and derivatives compared with differences. Textures made of others: scale, tint, product, channel, threshold, gamma.
 * Errors give the reason.
 */
#include "tests/support/nodes.h"
#include "tests/support/pictures.h"
#include "worker/render/texture/picture_cache.h"
#include "worker/render/texture/texture.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static const struct wavelengths grey = {.is_grey = true};
static const struct wavelengths colour = {.nm = {450, 550, 600, 700}};

struct fixture {
	struct arena arena;
	struct pictures pictures;
	struct asset_source source;
	struct texture_build build;
};

/* Picture 0 is 3 x 2 and grey: 0 .25 .5 / .75 1 .125. Picture 1 is 2 x 1: red, white. Picture 2 is bright grey. */
static int setup(void **state)
{
	static struct fixture f;
	const double levels[6] = {0, 0.25, 0.5, 0.75, 1, 0.125}, bright[3] = {4, 4, 4};
	double rgb[18];
	for (int i = 0; i < 18; i++)
		rgb[i] = levels[i / 3];
	f = (struct fixture){.arena = {0}};
	pictures_add(&f.pictures, 3, 2, rgb);
	pictures_add(&f.pictures, 2, 1, (double[]){0.5, 0.125, 0.0625, 0.5, 0.5, 0.5});
	pictures_add(&f.pictures, 1, 1, bright);
	f.source = pictures_source(&f.pictures);
	f.build = (struct texture_build){&f.source, &f.arena, true, NULL, NULL, false};
	*state = &f;
	return 0;
}

static int teardown(void **state)
{
	struct fixture *f = *state;
	pictures_fini(&f->pictures);
	arena_fini(&f->arena);
	return 0;
}

static int try_texture_text(struct fixture *f, const char *text, enum color_role role, struct texture *t,
			    struct error *e)
{
	struct scene_node *owner = node_make(&f->arena, PLUGIN_BSDF, "owner");
	node_add_ref(&f->arena, owner, "reflectance", node_make(&f->arena, PLUGIN_TEXTURE, text));
	return texture_from_node(t, owner, "reflectance", 0.5, role, &f->build, e);
}

static struct texture make_texture(struct fixture *f, const char *text, enum color_role role)
{
	struct texture t;
	struct error e;
	if (try_texture_text(f, text, role, &t, &e))
		fail_msg("%s: %s", text, e.text);
	return t;
}

static spectrum evaluate_texture(const struct texture *t, double u, double v, const struct wavelengths *w)
{
	const struct texture_point at = {.u = u, .v = v};
	return texture_eval(t, &at, w);
}

static void assert_value(const struct texture *t, double u, double v, double expected)
{
	double x = evaluate_texture(t, u, v, &grey).v[0];
	if (fabs(x - expected) > 1e-12)
		fail_msg("(%g, %g): %.15g is not %g", u, v, x, expected);
}

static void test_pixels_have_their_orientation_and_centres(void **state)
{
	struct texture t = make_texture(*state, "bitmap filename=p0", COLOR_REFLECTANCE);
	assert_int_equal(texture_color_kind(&t), COLOR_KIND_CONSTANT);
	assert_false(texture_is_constant(&t));
	assert_true(texture_max(&t) == 1);
	/* The upper left pixel is at small u and small v. */
	assert_value(&t, 0.5 / 3, 0.25, 0);
	assert_value(&t, 1.5 / 3, 0.25, 0.25);
	assert_value(&t, 0.5 / 3, 0.75, 0.75);
	assert_value(&t, 2.5 / 3, 0.75, 0.125);
	/* Half-way between neighbours, and across the borders. */
	assert_value(&t, 1.0 / 3, 0.25, 0.125);
	assert_value(&t, 0.5 / 3, 0.5, 0.375);
	assert_value(&t, 0, 0.25, 0.25);
	assert_value(&t, 0.5 / 3, 0, 0.375);
	assert_value(&t, 7 + 1.5 / 3, -4.75, 0.25);
	assert_value(&t, 1e300, 0.25, evaluate_texture(&t, 0, 0.25, &grey).v[0]);
}

static void test_coordinates_wrap(void **state)
{
	struct texture clamp = make_texture(*state, "bitmap filename=p0 wrap_mode=clamp", COLOR_REFLECTANCE);
	assert_value(&clamp, -3, 0.25, 0);
	assert_value(&clamp, 9, 9, 0.125);
	assert_value(&clamp, 0, 0, 0);
	struct texture mirror = make_texture(*state, "bitmap filename=p0 wrap_mode=mirror", COLOR_REFLECTANCE);
	assert_value(&mirror, -1.5 / 3, 0.25, 0.25);
	assert_value(&mirror, 1 + 0.5 / 3, 0.25, 0.5);
	assert_value(&mirror, 1 + 1.0 / 3, 0.25, 0.375);
	assert_value(&mirror, 2 + 0.5 / 3, 0.25, 0);
	struct texture mixed = make_texture(*state, "bitmap filename=p0 wrap_mode_u=clamp", COLOR_REFLECTANCE);
	assert_value(&mixed, -1, 1.25, 0);
}

/* Outside the image everything is black, or white; between the centres of the outermost pixels and of the border it is
 * interpolated. */
static void test_borders_are_black_or_white(void **state)
{
	struct texture black = make_texture(*state, "bitmap filename=p0 wrap_mode=black", COLOR_REFLECTANCE),
		       white = make_texture(*state, "bitmap filename=p0 wrap_mode=one", COLOR_REFLECTANCE),
		       mixed = make_texture(*state, "bitmap filename=p0 wrap_mode_u=zero wrap_mode_v=white",
					    COLOR_REFLECTANCE),
		       column = make_texture(*state, "bitmap filename=p0 wrap_mode_u=white", COLOR_REFLECTANCE),
		       nearest = make_texture(*state, "bitmap filename=p0 wrap_mode=white filter_type=none",
					      COLOR_REFLECTANCE);
	assert_value(&black, 2.5 / 3, 0.75, 0.125);
	assert_value(&black, 1, 0.75, 0.0625);
	assert_value(&black, 1 + 0.25 / 3, 0.75, 0.03125);
	assert_value(&black, 1 + 0.5 / 3, 0.75, 0);
	assert_value(&black, 1e9, 0.75, 0);
	assert_value(&white, 0, 0.25, 0.5);
	assert_value(&white, -0.5 / 3, 0.25, 1);
	assert_value(&white, 0.5 / 3, -1e30, 1);
	assert_value(&mixed, -0.5, 0.75, 0);
	assert_value(&mixed, 2.5 / 3, 1, 0.5625);
	assert_value(&mixed, -0.5, 1.5, 0);
	assert_value(&column, -0.5, 7.75, 1);
	assert_value(&column, 2.5 / 3, 7.75, 0.125);
	assert_value(&nearest, 0, 0, 0);
	assert_value(&nearest, -0x1p-60, 0.25, 1);
	assert_value(&nearest, 0.999, 0.999, 0.125);
	assert_value(&nearest, 1, 0.75, 1);
	struct texture lamp = make_texture(*state, "bitmap filename=p1 wrap_mode=white", COLOR_REFLECTANCE);
	assert_true(texture_max(&lamp) == 1);
}

static void test_nearest_does_not_interpolate(void **state)
{
	struct texture t = make_texture(*state, "bitmap filename=p0 filter_type=nearest", COLOR_REFLECTANCE);
	assert_value(&t, 0.01, 0.01, 0);
	assert_value(&t, 0.34, 0.49, 0.25);
	assert_value(&t, 0.99, 0.99, 0.125);
	assert_value(&t, -0x1p-60, 0.25, 0.5);
}

static void test_to_uv_transforms_coordinates(void **state)
{
	struct fixture *f = *state;
	struct texture t = make_texture(f, "bitmap filename=p0 uvscale=2 voffset=0.5", COLOR_REFLECTANCE);
	assert_value(&t, 0.75 / 3, 0.125, 1);
	t = make_texture(f, "bitmap filename=p0 uscale=3 uoffset=0.5", COLOR_REFLECTANCE);
	assert_value(&t, 0, 0.25, 0.25);
	struct scene_node *owner = node_make(&f->arena, PLUGIN_BSDF, "owner");
	struct scene_node *n = node_make(&f->arena, PLUGIN_TEXTURE, "bitmap filename=p0");
	const mat4 quarter = {{{0, 1, 0, 0}, {1, 0, 0, 0.25}, {0, 0, 1, 0}, {0, 0, 0, 1}}};
	struct error e;
	node_add_transform(&f->arena, n, "to_uv", quarter);
	node_add_ref(&f->arena, owner, "reflectance", n);
	assert_int_equal(texture_from_node(&t, owner, "reflectance", 0, COLOR_REFLECTANCE, &f->build, &e), 0);
	assert_value(&t, 0, 1.5 / 3, 0.25);
}

static void test_colours_of_images_are_kept(void **state)
{
	struct texture t = make_texture(*state, "bitmap filename=p1", COLOR_REFLECTANCE);
	assert_int_equal(texture_color_kind(&t), COLOR_KIND_OTHER);
	const double red[3] = {0.5, 0.125, 0.0625};
	spectrum s = evaluate_texture(&t, 0.25, 0.5, &colour), expected = color_eval_rgb_reflectance(red, &colour);
	for (int i = 0; i < SPECTRUM_LANES; i++) {
		assert_true(s.v[i] == expected.v[i]);
		assert_true(s.v[i] <= texture_max(&t));
	}
	assert_true(texture_max(&t) <= 1);

	t = make_texture(*state, "bitmap filename=p2", COLOR_REFLECTANCE);
	assert_value(&t, 0.5, 0.5, 1);
	t = make_texture(*state, "bitmap filename=p2", COLOR_ILLUMINANT);
	assert_int_equal(texture_color_kind(&t), COLOR_KIND_D65);
	s = evaluate_texture(&t, 0.5, 0.5, &colour);
	assert_true(fabs(s.v[1] - 4 * color_d65(550)) < 1e-12);
	assert_value(&t, 0.5, 0.5, 4);
	assert_true(texture_max(&t) >= spectrum_max(s));
}

static void test_checkerboard_alternates_colours(void **state)
{
	struct texture t = make_texture(*state, "checkerboard", COLOR_REFLECTANCE);
	assert_value(&t, 0.25, 0.25, 0.4);
	assert_value(&t, 0.75, 0.25, 0.2);
	assert_value(&t, 0.25, 0.75, 0.2);
	assert_value(&t, -0.25, -0.25, 0.4);
	assert_true(texture_max(&t) == 0.4);
	assert_int_equal(texture_color_kind(&t), COLOR_KIND_CONSTANT);
	t = make_texture(*state, "checkerboard color0=1 color1=0 uscale=4", COLOR_REFLECTANCE);
	assert_value(&t, 0.25 / 4, 0.25, 1);
	assert_value(&t, 0.75 / 4, 0.25, 0);
	t = make_texture(*state, "checkerboard color0=rgb(1,0.5,0.2)", COLOR_REFLECTANCE);
	assert_int_equal(texture_color_kind(&t), COLOR_KIND_OTHER);
}

static void test_gridtexture_has_lines(void **state)
{
	struct texture t = make_texture(*state, "gridtexture", COLOR_REFLECTANCE);
	assert_value(&t, 0.5, 0.5, 0.2);
	assert_value(&t, 0.98, 0.02, 0.2);
	assert_value(&t, 0.995, 0.5, 0.4);
	assert_value(&t, 0.5, 3.005, 0.4);
	assert_value(&t, -1.005, -0.5, 0.4);
	t = make_texture(*state, "gridtexture color0=1 color1=0 line_width=0.1 uscale=4 voffset=0.5",
			 COLOR_REFLECTANCE);
	assert_value(&t, 0.25, 0, 0);
	assert_value(&t, 0.27, 0, 0);
	assert_value(&t, 0.28, 0, 1);
	assert_value(&t, 0.375, 0.5, 0);
	assert_value(&t, 0.375, 0.35, 1);
}

static void test_missing_values_use_the_fallback(void **state)
{
	struct fixture *f = *state;
	struct scene_node *n = node_make(&f->arena, PLUGIN_BSDF, "owner reflectance=0.25");
	struct texture t;
	struct error e;
	assert_int_equal(texture_from_node(&t, n, "reflectance", 0.5, COLOR_REFLECTANCE, &f->build, &e), 0);
	assert_true(texture_is_constant(&t) && texture_max(&t) == 0.25);
	assert_int_equal(texture_from_node(&t, n, "absent", 0.5, COLOR_REFLECTANCE, &f->build, &e), 0);
	assert_value(&t, 0, 0, 0.5);
	assert_int_equal(texture_from_node(&t, n, "absent", 2, COLOR_ILLUMINANT, &f->build, &e), 0);
	assert_int_equal(texture_color_kind(&t), COLOR_KIND_D65);
}

static void test_refusals_say_why(void **state)
{
	static const struct {
		const char *text, *word;
	} bad[] = {{"wood", "wood"},
		   {"bitmap", "filename"},
		   {"bitmap filename=nowhere", "nowhere"},
		   {"bitmap filename=p0 gamma=-2", "gamma = -2; it is -1 (sRGB), 1 (linear) or"},
		   {"bitmap filename=p2 gamma=70", "gamma = 70 makes a number that is too large: 4 to that power"},
		   {"bitmap filename=p0 channel=a", "alpha is only read from PNG, WebP and TGA"},
		   {"checkerboard color0=3", "color0"}};
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
		struct texture t;
		struct error e = {{0}};
		if (try_texture_text(*state, bad[i].text, COLOR_REFLECTANCE, &t, &e) >= 0 ||
		    !strstr(e.text, bad[i].word))
			fail_msg("%s: \"%s\" does not say \"%s\"", bad[i].text, e.text, bad[i].word);
	}
}

/* Where any number is allowed, such as for the indices of metals, the values of an image are those of a reflectance. */
static void test_unbounded_images_have_the_values_of_reflectances(void **state)
{
	struct texture bounded = make_texture(*state, "bitmap filename=p0", COLOR_REFLECTANCE),
		       unbounded = make_texture(*state, "bitmap filename=p0", COLOR_UNBOUNDED);
	for (int i = 0; i < 16; i++) {
		double u = (i % 4 + 0.5) / 4, v = (i / 4 + 0.5) / 4;
		spectrum a = evaluate_texture(&bounded, u, v, &colour), b = evaluate_texture(&unbounded, u, v, &colour);
		assert_memory_equal(&a, &b, sizeof a);
	}
}

/* Compares derivatives with differences, which are exact up to rounding where the texture is a polynomial, that is
 * between pixel centres. */
static void assert_derivatives(const struct texture *t, double u, double v, double h)
{
	struct texture_derivatives j, n[4];
	texture_eval_derivatives(t, u, v, &j);
	for (int k = 0; k < 4; k++)
		texture_eval_derivatives(t,
					 u + (k == 0   ? h
					      : k == 1 ? -h
						       : 0),
					 v + (k == 2   ? h
					      : k == 3 ? -h
						       : 0),
					 &n[k]);
	for (int c = 0; c < 3; c++) {
		const double given[5] = {j.du[c], j.dv[c], j.duu[c], j.duv[c], j.dvv[c]};
		const double found[5] = {(n[0].x[c] - n[1].x[c]) / (2 * h), (n[2].x[c] - n[3].x[c]) / (2 * h),
					 (n[0].du[c] - n[1].du[c]) / (2 * h), (n[0].dv[c] - n[1].dv[c]) / (2 * h),
					 (n[2].dv[c] - n[3].dv[c]) / (2 * h)};
		for (int k = 0; k < 5; k++)
			if (fabs(given[k] - found[k]) > 1e-9 / h * 1e-4)
				fail_msg("(%g, %g) derivative %d: %g is not %g", u, v, k, given[k], found[k]);
	}
}

static void test_derivatives_match_differences(void **state)
{
	struct fixture *f = *state;
	const char *const texts[] = {"bitmap filename=p0 raw=true",
				     "bitmap filename=p0 raw=true uscale=2 vscale=-3 uoffset=0.1",
				     "bitmap filename=p0 raw=true wrap_mode=mirror",
				     "bitmap filename=p0 raw=true wrap_mode=clamp",
				     "bitmap filename=p0 raw=true wrap_mode_u=white wrap_mode_v=black",
				     "bitmap filename=p1 raw=true filter_type=nearest",
				     "checkerboard color0=1 color1=-3"};
	for (size_t k = 0; k < sizeof texts / sizeof *texts; k++) {
		struct texture t = make_texture(f, texts[k], COLOR_RELIEF);
		/* Not near lines through pixel centres or between squares. */
		for (int i = 0; i < 60; i++)
			assert_derivatives(&t, -2.03 + 0.0711 * i, 1.07 + 0.0577 * i, 1e-7);
	}
	struct texture t = make_texture(f, "bitmap filename=p0 raw=true wrap_mode=mirror", COLOR_RELIEF);
	struct texture_derivatives j;
	texture_eval_derivatives(&t, 1.0 / 3, 0.25, &j);
	assert_true(fabs(j.x[0] - 0.125) < 1e-12 && fabs(j.du[0] - 0.75) < 1e-12 && fabs(j.dv[0] - 1.5) < 1e-12);
	texture_eval_derivatives(&t, 2 - 1.0 / 3, 0.25, &j);
	assert_true(fabs(j.x[0] - 0.125) < 1e-12 && fabs(j.du[0] + 0.75) < 1e-12);
}

/* A reflectance made darker, or brighter up to white, and heights of either sign. */
static void test_scale_multiplies_values(void **state)
{
	struct fixture *f = *state;
	struct scene_node *n = node_make(&f->arena, PLUGIN_TEXTURE, "scale scale=2");
	node_add_child(&f->arena, n, node_make(&f->arena, PLUGIN_TEXTURE, "bitmap filename=p0"));
	struct texture t;
	struct error e = {""};
	assert_int_equal(texture_create(&t, n, COLOR_REFLECTANCE, &f->build, &e), 0);
	assert_value(&t, 1.5 / 3, 0.25, 0.5);
	assert_value(&t, 0.5 / 3, 0.75, 1);
	assert_true(texture_max(&t) == 1 && texture_color_kind(&t) == COLOR_KIND_CONSTANT);
	n = node_make(&f->arena, PLUGIN_TEXTURE, "scale scale=0.5 value=rgb(0.8,0.8,0.8)");
	assert_int_equal(texture_create(&t, n, COLOR_REFLECTANCE, &f->build, &e), 0);
	assert_value(&t, 0.2, 0.7, 0.4);
	n = node_make(&f->arena, PLUGIN_TEXTURE, "scale scale=0.5");
	assert_true(texture_create(&t, n, COLOR_REFLECTANCE, &f->build, &e) < 0 && strstr(e.text, "a texture inside"));
	n = node_make(&f->arena, PLUGIN_TEXTURE, "scale scale=-2");
	node_add_child(&f->arena, n, node_make(&f->arena, PLUGIN_TEXTURE, "bitmap filename=p0"));
	assert_true(texture_create(&t, n, COLOR_ILLUMINANT, &f->build, &e) < 0 && strstr(e.text, "negative colours"));
	assert_int_equal(texture_create(&t, n, COLOR_HEIGHT, &f->build, &e), 0);
	assert_true(fabs(texture_height(&t, 1.5 / 3, 0.25) + 0.5) < 1e-12);
	struct texture_derivatives j;
	assert_int_equal(texture_create(&t, n, COLOR_RELIEF, &f->build, &e), 0);
	texture_eval_derivatives(&t, 1.0 / 3, 0.25, &j);
	assert_true(fabs(j.du[0] + 1.5) < 1e-12 && fabs(j.x[0] + 0.25) < 1e-12);
}

/* The height of a colour is its luminance, as for coloured images. */
static void test_height_of_a_colour_is_its_luminance(void **state)
{
	struct fixture *f = *state;
	struct texture t = make_texture(f, "checkerboard color0=rgb(1,0.5,0.25) color1=-3", COLOR_HEIGHT);
	assert_true(fabs(texture_height(&t, 0.25, 0.25) - (0.2126 + 0.5 * 0.7152 + 0.25 * 0.0722)) < 1e-12);
	assert_true(texture_height(&t, 0.75, 0.25) == -3);
}

/* For a coloured image that stands for a number, Mitsuba 3 takes the luminance and 0.6 the mean, at all wavelengths;
 * Mitsuba 3's checkerboards of numbers begin with color1. */
static void test_coloured_images_as_numbers_follow_the_dialect(void **state)
{
	struct fixture *f = *state;
	static const struct {
		const char *text;
		bool dialect_3;
		double u, expected;
	} cases[] = {
		{"bitmap filename=p1 filter_type=nearest", true, 0.25, 0.2126 * 0.5 + 0.7152 * 0.125 + 0.0722 * 0.0625},
		{"bitmap filename=p1 filter_type=nearest", false, 0.25, (0.5 + 0.125 + 0.0625) / 3},
		{"bitmap filename=p1 filter_type=nearest", true, 0.75, 0.5},
		{"bitmap filename=p1 filter_type=nearest channel=g", true, 0.25, 0.125},
		{"bitmap filename=p1 filter_type=nearest gamma=2", false, 0.25, (0.25 + 1.0 / 64 + 1.0 / 256) / 3},
		{"checkerboard color0=0.1 color1=0.7", true, 0.25, 0.7},
		{"checkerboard color0=0.1 color1=0.7", true, 0.75, 0.1},
		{"checkerboard color0=0.1 color1=0.7", false, 0.25, 0.1},
		{"gridtexture color0=0.1 color1=0.7", false, 0.25, 0.1},
	};
	const struct texture_build build = f->build;
	struct picture_cache cache = {.arena = &f->arena};
	f->source.picture_cache = &cache;
	struct texture red = make_texture(f, "bitmap filename=p1 filter_type=nearest", COLOR_REFLECTANCE);
	f->build.is_number = true;
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		f->build.is_dialect_3 = cases[i].dialect_3;
		struct texture t = make_texture(f, cases[i].text, COLOR_REFLECTANCE);
		spectrum x = evaluate_texture(&t, cases[i].u, 0.25, &colour);
		for (int k = 0; k < SPECTRUM_LANES; k++)
			if (fabs(x.v[k] - cases[i].expected) > 1e-7) /* rounding of floats */
				fail_msg("row %zu: %.9g is not %.9g", i, x.v[k], cases[i].expected);
	}
	f->build = build;
	f->source.picture_cache = NULL;
	/* The colour is not affected by the other use of the same file. */
	spectrum x = evaluate_texture(&red, 0.25, 0.25, &colour);
	assert_true(x.v[2] > 2 * x.v[1]);
}

static struct texture tinted_texture(struct fixture *f, const char *scale, const char *inner, enum color_role role)
{
	struct scene_node *n = node_make(&f->arena, PLUGIN_TEXTURE, scale);
	struct texture t;
	struct error e;
	node_add_child(&f->arena, n, node_make(&f->arena, PLUGIN_TEXTURE, inner));
	if (texture_create(&t, n, role, &f->build, &e))
		fail_msg("%s", e.text);
	return t;
}

/* A colour times a colour is their product at each wavelength; the part of a colour above 1 becomes a factor. */
static void test_colour_times_colour_is_their_product(void **state)
{
	struct fixture *f = *state;
	const double red[3] = {0.5, 0.125, 0.0625}, tint[3] = {0.25, 1, 0.5};
	struct color other;
	assert_int_equal(color_from_rgb(tint, COLOR_REFLECTANCE, &other), 0);
	spectrum a = color_eval_rgb_reflectance(red, &colour), b = color_eval(&other, &colour),
		 light = color_eval_rgb_illuminant(red, &colour);
	struct texture t = tinted_texture(f, "scale scale=rgb(0.25,1,0.5)", "bitmap filename=p1", COLOR_REFLECTANCE),
		       lamp = tinted_texture(f, "scale scale=rgb(1,4,2)", "bitmap filename=p1", COLOR_ILLUMINANT);
	spectrum x = evaluate_texture(&t, 0.25, 0.5, &colour), y = evaluate_texture(&lamp, 0.25, 0.5, &colour);
	for (int i = 0; i < SPECTRUM_LANES; i++) {
		assert_true(fabs(x.v[i] - a.v[i] * b.v[i]) < 1e-12);
		assert_true(fabs(y.v[i] - 4 * light.v[i] * b.v[i]) < 1e-12 * y.v[i]);
		assert_true(x.v[i] <= texture_max(&t));
	}
	t = tinted_texture(f, "scale scale=rgb(0.25,1,0.5)", "bitmap filename=p0", COLOR_REFLECTANCE);
	assert_int_equal(texture_color_kind(&t), COLOR_KIND_OTHER);
	t = tinted_texture(f, "scale scale=rgb(0.5,0.5,0.5)", "bitmap filename=p0", COLOR_REFLECTANCE);
	assert_int_equal(texture_color_kind(&t), COLOR_KIND_CONSTANT);
	assert_value(&t, 0.5 / 3, 0.75, 0.375);
	struct scene_node *n = node_make(&f->arena, PLUGIN_TEXTURE, "scale scale=rgb(1,1,0)");
	struct error e;
	node_add_child(&f->arena, n, node_make(&f->arena, PLUGIN_TEXTURE, "bitmap filename=p0"));
	assert_true(texture_create(&t, n, COLOR_HEIGHT, &f->build, &e) < 0 &&
		    strstr(e.text, "a number here, not a colour"));
}

/* A texture times a texture is their product at each point. */
static void test_texture_times_texture_is_their_product(void **state)
{
	struct fixture *f = *state;
	struct scene_node *n = node_make(&f->arena, PLUGIN_TEXTURE, "scale");
	struct error e;
	struct texture t;
	node_add_ref(&f->arena, n, "scale", node_make(&f->arena, PLUGIN_TEXTURE, "bitmap filename=p0"));
	node_add_child(&f->arena, n, node_make(&f->arena, PLUGIN_TEXTURE, "bitmap filename=p1"));
	assert_int_equal(texture_create(&t, n, COLOR_REFLECTANCE, &f->build, &e), 0);
	assert_int_equal(texture_color_kind(&t), COLOR_KIND_OTHER);
	struct texture p0 = make_texture(f, "bitmap filename=p0", COLOR_REFLECTANCE),
		       p1 = make_texture(f, "bitmap filename=p1", COLOR_REFLECTANCE);
	for (int k = 0; k < 20; k++) {
		double u = k % 5 / 5.0, v = k / 5 / 4.0;
		spectrum x = evaluate_texture(&t, u, v, &colour), a = evaluate_texture(&p0, u, v, &colour),
			 b = evaluate_texture(&p1, u, v, &colour);
		for (int i = 0; i < SPECTRUM_LANES; i++)
			assert_true(x.v[i] == a.v[i] * b.v[i] && x.v[i] <= texture_max(&t));
	}
	assert_true(texture_create(&t, n, COLOR_RELIEF, &f->build, &e) < 0 &&
		    strstr(e.text, "a number here, not a texture"));
}

static void test_channel_and_threshold_are_applied(void **state)
{
	struct texture t = make_texture(*state, "bitmap filename=p1 channel=g", COLOR_REFLECTANCE);
	assert_int_equal(texture_color_kind(&t), COLOR_KIND_CONSTANT);
	assert_value(&t, 0.25, 0.5, 0.125);
	t = make_texture(*state, "bitmap filename=p1 channel=b", COLOR_REFLECTANCE);
	assert_value(&t, 0.25, 0.5, 0.0625);
	t = make_texture(*state, "bitmap filename=p0 threshold=0.5 filter_type=nearest", COLOR_REFLECTANCE);
	assert_value(&t, 1.5 / 3, 0.25, 0);
	assert_value(&t, 2.5 / 3, 0.25, 1); /* 0.5 itself counts as above the threshold */
	assert_value(&t, 0.5 / 3, 0.75, 1);
}

/* The stored numbers are raised to the power gamma before the threshold; images with another gamma are not shared. */
static void test_gamma_is_applied_before_the_threshold(void **state)
{
	struct texture t = make_texture(*state, "bitmap filename=p0 gamma=2.2", COLOR_REFLECTANCE);
	assert_value(&t, 1.5 / 3, 0.25, (double)(float)pow(0.25, 2.2));
	assert_value(&t, 0.5 / 3, 0.75, (double)(float)pow(0.75, 2.2));
	t = make_texture(*state, "bitmap filename=p0 gamma=1", COLOR_REFLECTANCE);
	assert_value(&t, 1.5 / 3, 0.25, 0.25);
	t = make_texture(*state, "bitmap filename=p0 gamma=0.5 threshold=0.5 filter_type=nearest", COLOR_REFLECTANCE);
	assert_value(&t, 1.5 / 3, 0.25, 1); /* 0.5, the square root of 0.25, reaches the threshold */
	assert_value(&t, 2.5 / 3, 0.75, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_pixels_have_their_orientation_and_centres),
		cmocka_unit_test(test_coordinates_wrap),
		cmocka_unit_test(test_borders_are_black_or_white),
		cmocka_unit_test(test_nearest_does_not_interpolate),
		cmocka_unit_test(test_to_uv_transforms_coordinates),
		cmocka_unit_test(test_derivatives_match_differences),
		cmocka_unit_test(test_scale_multiplies_values),
		cmocka_unit_test(test_height_of_a_colour_is_its_luminance),
		cmocka_unit_test(test_coloured_images_as_numbers_follow_the_dialect),
		cmocka_unit_test(test_colour_times_colour_is_their_product),
		cmocka_unit_test(test_texture_times_texture_is_their_product),
		cmocka_unit_test(test_channel_and_threshold_are_applied),
		cmocka_unit_test(test_gamma_is_applied_before_the_threshold),
		cmocka_unit_test(test_colours_of_images_are_kept),
		cmocka_unit_test(test_checkerboard_alternates_colours),
		cmocka_unit_test(test_gridtexture_has_lines),
		cmocka_unit_test(test_missing_values_use_the_fallback),
		cmocka_unit_test(test_refusals_say_why),
		cmocka_unit_test(test_unbounded_images_have_the_values_of_reflectances),
	};
	return cmocka_run_group_tests(tests, setup, teardown);
}
