/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Displacement in scenes: which parameters the reader accepts and refuses, the heights of bitmaps, the reported
 * effect, an unchanged image at height zero, and agreement of the integrators on displaced surfaces and displaced
 * lights (tests/support/agreement.h).
 */
#include "worker/render/render.h"
#include "tests/support/agreement.h"
#include "tests/support/leases.h"
#include "tests/support/memory_assets.h"
#include "tests/support/sample_images.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define LEVEL(l) "<integer name='displacement_level' value='" l "'/>"
#define SCALE(s) "<float name='displacement_scale' value='" s "'/>"
#define CHECKERS \
	"<texture name='displacement' type='checkerboard'><float name='color0' value='0.25'/><float name='color1' value='-1'/></texture>"
#define BITMAP(inner) \
	"<texture name='displacement' type='bitmap'><string name='filename' value='h.png'/>" inner "</texture>"
#define RECTANGLE(inner) SENSOR("0,0,5", "0,0,0") "<shape type='rectangle'>" inner "</shape>"

static const struct effect_line *find_displacement_effect(const struct world *w)
{
	for (size_t i = 0; i < w->effects.effect_line_count; i++)
		if (strcmp(w->effects.effect_lines[i].name, "displacement") == 0)
			return &w->effects.effect_lines[i];
	fail_msg("no line about displacement");
	return NULL;
}

static void test_displacement_is_listed_as_an_effect(void **state)
{
	(void)state;
	struct world *w = world_from_text(8, 8, RECTANGLE("") "%s", "");
	assert_false(find_displacement_effect(w)->is_on);
	assert_string_equal(find_displacement_effect(w)->reason, "no shape is displaced");
	world_free(w);
	w = world_from_text(8, 8,
			    RECTANGLE(CHECKERS SCALE("0.1") LEVEL("6")) "<shape type='sphere'>" CHECKERS SCALE("0.1")
				    LEVEL("3") "</shape>%s",
			    "");
	assert_true(find_displacement_effect(w)->is_on);
	assert_string_equal(find_displacement_effect(w)->reason,
			    "the rectangle in test.xml:1 and 1 more are displaced: 8704 triangles");
	assert_false(w->shapes[1].is_sphere);
	world_free(w);
}

/* Returns the position of a vertex in scene units. */
static vec3 vertex_position(const struct world *w, uint32_t shape, uint32_t i)
{
	const float *p = w->shapes[shape].position[i];
	return vec3_madd(w->center, 1 / w->scale, (vec3){(double)p[0], (double)p[1], (double)p[2]});
}

static struct world *world_with_picture(const char *inner)
{
	char xml[2048];
	size_t size;
	unsigned char *png = sample_png(16, 16, SAMPLE_GREY, 8, 0, &size);
	snprintf(xml, sizeof xml, "<scene version='3.0.0'>" RECTANGLE("%s") "</scene>", inner);
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {"h.png", png, size}, {NULL, NULL, 0}};
	struct world *w = world_from_files(8, 8, files);
	free(png);
	return w;
}

/* At pixel centres the height is the stored value over 255, unless the scene says that the bitmap is sRGB. */
static void test_bitmap_pixels_give_heights(void **state)
{
	(void)state;
	struct world *w = world_with_picture(BITMAP("") SCALE("2") LEVEL("5"));
	struct world *decoded = world_with_picture(BITMAP("<boolean name='raw' value='false'/>") SCALE("2") LEVEL("5"));
	uint32_t centres = 0;
	for (uint32_t i = 0; i < w->shapes[0].vertex_count; i++) {
		vec3 p = vertex_position(w, 0, i);
		double x = 16 * (double)w->shapes[0].uv[i][0], y = 16 * (double)w->shapes[0].uv[i][1];
		if (x - floor(x) != 0.5 || y - floor(y) != 0.5)
			continue;
		centres++;
		double stored = sample_value((size_t)x, (size_t)y, 0) / 255.0;
		double linear = stored <= 0.04045 ? stored / 12.92 : pow((stored + 0.055) / 1.055, 2.4);
		assert_true(fabs(p.z - 2 * stored) < 1e-6);
		assert_true(fabs(vertex_position(decoded, 0, i).z - 2 * linear) < 1e-6);
	}
	assert_int_equal(centres, 256);
	world_free(w);
	world_free(decoded);
}

static void test_numbers_and_checkerboards_give_heights(void **state)
{
	(void)state;
	struct world *w = world_from_text(
		8, 8, RECTANGLE("<float name='displacement' value='-0.5'/>" SCALE("3") LEVEL("0")) "%s", "");
	for (uint32_t i = 0; i < 4; i++)
		assert_true(vertex_position(w, 0, i).z == -1.5);
	world_free(w);
	w = world_from_text(8, 8, RECTANGLE(CHECKERS LEVEL("2")) "%s", "");
	bool low = false, high = false;
	for (uint32_t i = 0; i < w->shapes[0].vertex_count; i++) {
		low |= vertex_position(w, 0, i).z == -1;
		high |= vertex_position(w, 0, i).z == 0.25;
	}
	assert_true(low && high);
	world_free(w);
}

static void expect_refused(const char *inner, const char *text)
{
	char xml[2048];
	snprintf(xml, sizeof xml, "<scene version='3.0.0'>" RECTANGLE("%s") "</scene>", inner);
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {NULL, NULL, 0}};
	struct asset_source assets = memory_assets(files);
	struct scene s;
	struct render_summary summary;
	struct error e = {""};
	int rc = scene_read(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e);
	if (!rc) {
		rc = world_check(&s, &assets, NULL, &summary, &e);
		scene_fini(&s);
	}
	if (rc >= 0 || !strstr(e.text, text))
		fail_msg("%s\n gave %d: %s\n not: %s", inner, rc, e.text, text);
}

static void test_invalid_displacements_are_refused(void **state)
{
	(void)state;
	expect_refused(CHECKERS LEVEL("-1"), "displacement_level=-1 is outside [0, 13]");
	expect_refused(CHECKERS LEVEL("14"), "displacement_level=14 is outside [0, 13]");
	expect_refused(CHECKERS LEVEL("99999999999999999999"), "is too large");
	expect_refused(CHECKERS LEVEL("2.5"), "is not a whole number");
	expect_refused(CHECKERS, "displacement needs displacement_level, 0 to 13");
	expect_refused(CHECKERS SCALE("nan") LEVEL("1"), "`nan` is not");
	expect_refused(CHECKERS SCALE("inf") LEVEL("1"), "`inf` is not");
	expect_refused(CHECKERS SCALE("1e61") LEVEL("1"), "displacement_scale=1e+61 is outside");
	expect_refused(SCALE("1"), "displacement_scale without a texture named displacement");
	expect_refused(LEVEL("1"), "displacement_level without a texture named displacement");
	expect_refused(BITMAP("") LEVEL("1"), "h.png: no such file");
	expect_refused("<bsdf name='displacement' type='diffuse'/>" LEVEL("1"),
		       "`displacement` may be a texture, but not a bsdf");
	expect_refused("<rgb name='displacement' value='1,0.5,1'/>" LEVEL("1"), "`displacement` cannot have this type");
	expect_refused(
		"<texture name='displacement' type='checkerboard'><spectrum name='color0' value='400:1, 700:0.5'/></texture>" LEVEL(
			"1"),
		"color0: a height or a normal is a number or an RGB colour, not a spectrum");
}

enum { SIDE = 32 };

#define GLOSSY "<bsdf type='roughconductor'><float name='alpha' value='0.2'/></bsdf>"
#define GROUND "<transform name='to_world'><scale value='4'/><rotate x='1' angle='-90'/></transform>"
/* clang-format off */
#define LAMP                                                                                                                    \
	"<shape type='sphere'><point name='center' x='1' y='4' z='1'/><float name='radius' value='0.7'/>"                       \
	"<emitter type='area'><float name='radiance' value='9'/></emitter></shape>"
/* clang-format on */

static struct world *make_flat_world(const char *displacement)
{
	return world_from_text(
		SIDE, SIDE,
		SENSOR("0,3,6", "0,0.5,0") LAMP
		"<shape type='rectangle'>" GROUND "%s</shape><shape type='cube'>"
		"<transform name='to_world'><rotate y='1' angle='30'/><translate y='1'/></transform>" GLOSSY
		"%s</shape>",
		displacement, displacement);
}

/* Floats round differently on finer triangles: a path near an edge may change completely, and all others change by
 * rounding. */
static void test_height_zero_keeps_the_image(void **state)
{
	(void)state;
	float *plain = leases_render_image(make_flat_world(""), SIDE, 16, 4),
	      *zero = leases_render_image(make_flat_world(CHECKERS SCALE("0") LEVEL("4")), SIDE, 16, 4);
	size_t differ = 0;
	double a = 0, b = 0;
	for (size_t i = 0; i < (size_t)SIDE * SIDE * 3; i++) {
		double x = (double)plain[i], y = (double)zero[i];
		a += x;
		b += y;
		differ += !(fabs(x - y) <= 1e-4 * (x + y));
	}
	print_message("%zu of %d values differ, the mean by %.1e\n", differ, SIDE * SIDE * 3, b / a - 1);
	assert_true(a > 0);
	assert_true(differ < SIDE * SIDE * 3 / 20);
	assert_true(fabs(b / a - 1) < 1e-3);
	free(plain);
	free(zero);
}

/* A rough ground, a glossy displaced ball, and a displaced lamp with textured radiance; a dim sky reduces the noise. */
static void test_integrators_agree(void **state)
{
	(void)state;
	char xml[4096];
	size_t size;
	unsigned char *png = sample_png(8, 8, SAMPLE_GREY, 8, 0, &size);
	/* clang-format off */
	snprintf(xml, sizeof xml,
		"<scene version='3.0.0'>"
			"<integrator type='path'><integer name='max_depth' value='3'/></integrator>"
			SENSOR("0,4.5,3", "0,0.5,0")
			"<shape type='rectangle'>"
				GROUND
				BITMAP("")
				SCALE("0.2")
				LEVEL("4")
			"</shape>"
			"<shape type='sphere'>"
				"<point name='center' x='0' y='1.2' z='0'/>"
				BITMAP("")
				SCALE("0.1")
				LEVEL("4")
				GLOSSY
			"</shape>"
			"<shape type='rectangle'>"
				"<transform name='to_world'>"
					"<scale value='3'/>"
					"<rotate x='1' angle='90'/>"
					"<translate y='5'/>"
				"</transform>"
				BITMAP("")
				SCALE("0.2")
				LEVEL("3")
				"<emitter type='area'>"
					"<texture name='radiance' type='bitmap'>"
						"<string name='filename' value='h.png'/>"
					"</texture>"
				"</emitter>"
			"</shape>"
			"<emitter type='constant'><float name='radiance' value='0.5'/></emitter>"
		"</scene>");
	/* clang-format on */
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {"h.png", png, size}, {NULL, NULL, 0}};
	struct world *w = world_from_files(32, 32, files);
	static struct agreement_image path, bdpt;
	agreement_render(w, __func__, "path", &(struct agreement_options){"path", 1280, 32, 0, 0}, &path);
	agreement_render(w, __func__, "bdpt", &(struct agreement_options){"bdpt", 1280, 32, 0, 0}, &bdpt);
	agreement_check(__func__, &bdpt, &path);
	world_free(w);
	free(png);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_displacement_is_listed_as_an_effect),
		cmocka_unit_test(test_bitmap_pixels_give_heights),
		cmocka_unit_test(test_numbers_and_checkerboards_give_heights),
		cmocka_unit_test(test_invalid_displacements_are_refused),
		cmocka_unit_test(test_height_zero_keeps_the_image),
		cmocka_unit_test(test_integrators_agree),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
