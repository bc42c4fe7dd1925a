/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Bump and normal maps in scenes. A bump map must look like real geometry of the same height, the y axis of a normal
 * map must point in the direction that the file's version says, and all integrators must agree on a room in which
 * every surface has bent normals (tests/support/agreement.h).
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

enum { SIDE = 32 };

#define PICTURE "<string name='filename' value='h.png'/><boolean name='raw' value='true'/>"
#define SUN "<emitter type='directional'><vector name='direction' x='-1' y='-1' z='-1.5'/></emitter>"
/* The outline, which moves with real geometry, is out of view. */
#define VIEW SENSOR("0.1,0.1,1.9", "0,0,0")

static struct world *world_with_picture(const char *inside)
{
	static char xml[8192];
	size_t size;
	unsigned char *png = sample_png(8, 8, SAMPLE_GREY, 8, 0, &size);
	snprintf(xml, sizeof xml, "<scene version='3.0.0'>%s</scene>", inside);
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {"h.png", png, size}, {NULL, NULL, 0}};
	struct world *w = world_from_files(SIDE, SIDE, files);
	free(png);
	return w;
}

/* Stores the luminance of each pixel. */
static void render_luminance(struct world *w, double mean[SIDE * SIDE])
{
	float *xyz = leases_render_image(w, SIDE, 64, 2);
	for (int i = 0; i < SIDE * SIDE; i++)
		mean[i] = (double)xyz[3 * i + 1];
	free(xyz);
}

/* Returns the root mean square of the difference, divided by the root mean square of b. */
static double relative_difference(const double *a, const double *b)
{
	double d = 0, m = 0;
	for (int i = 0; i < SIDE * SIDE; i++) {
		d += (a[i] - b[i]) * (a[i] - b[i]);
		m += b[i] * b[i];
	}
	return sqrt(d / m);
}

/* 256 x 256 cells of height 0.02 at most, in sunlight: shadows are short, and slopes reach about 0.1. */
static void test_bump_map_matches_geometry(void **state)
{
	(void)state;
	static double flat[SIDE * SIDE], bump[SIDE * SIDE], real[SIDE * SIDE], back[SIDE * SIDE];
	render_luminance(world_with_picture(VIEW SUN "<shape type='rectangle'/>"), flat);
	/* clang-format off */
	render_luminance(world_with_picture(
		VIEW SUN
		"<shape type='rectangle'>"
			"<bsdf type='bumpmap'>"
				"<float name='scale' value='0.02'/>"
				"<texture type='bitmap' name='any'>" PICTURE "</texture>"
				"<bsdf type='diffuse'/>"
			"</bsdf>"
		"</shape>"), bump);
	render_luminance(world_with_picture(
		VIEW SUN
		"<shape type='rectangle'>"
			"<bsdf type='bumpmap'>"
				"<float name='scale' value='-0.02'/>"
				"<texture type='bitmap' name='any'>" PICTURE "</texture>"
				"<bsdf type='diffuse'/>"
			"</bsdf>"
		"</shape>"), back);
	render_luminance(world_with_picture(
		VIEW SUN
		"<shape type='rectangle'>"
			"<texture name='displacement' type='bitmap'>" PICTURE "</texture>"
			"<float name='displacement_scale' value='0.02'/>"
			"<integer name='displacement_level' value='8'/>"
		"</shape>"), real);
	/* clang-format on */
	print_message("apart from displaced geometry: flat %.3g, bump %.3g, dents %.3g\n",
		      relative_difference(flat, real), relative_difference(bump, real),
		      relative_difference(back, real));
	assert_true(relative_difference(flat, real) > 0.01);
	assert_true(relative_difference(bump, real) < 0.15 * relative_difference(flat, real));
	assert_true(relative_difference(back, real) > relative_difference(flat, real));
}

/* A square whose normals lean by 45 degrees along the map's y, in light that falls along this direction or
 * perpendicular to it: the square is as bright as a flat one lit from the front, or black. obj: seen from outside, u
 * runs to the right or to the left, and v up, or down in files with flipped v. */
static void test_normal_maps_have_the_right_y(void **state)
{
	(void)state;
	static const struct {
		const char *us, *flip, *handed;
		bool up;
	} cases[] = {
		{"0110", "true", "", true},
		{"0110", "false", "", true},
		{"1001", "true", "", false},
		{"1001", "false", "", false},
		{"0110", "true", "<boolean name='handedness' value='true'/>", true},
		{"0110", "false", "<boolean name='handedness' value='true'/>", false},
		{"1001", "true", "<boolean name='handedness' value='true'/>", true},
		{"1001", "false", "<boolean name='handedness' value='true'/>", false},
	};
	for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++)
		for (int up = 0; up < 2; up++) {
			const char *u = cases[k].us;
			char xml[2048], obj[512];
			snprintf(obj, sizeof obj,
				 "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt %c 0\nvt %c 0\nvt %c 1\nvt %c 1\n"
				 "vn 0 0 1\nf 1/1/1 2/2/1 3/3/1\nf 1/1/1 3/3/1 4/4/1\n",
				 u[0], u[1], u[2], u[3]);
			int n = snprintf(
				xml, sizeof xml,
				"<scene version='3.0.0'>" VIEW
				"<emitter type='directional'><vector name='direction' x='0' y='%d' z='-1'/>"
				"</emitter><shape type='obj'><string name='filename' value='m.obj'/>"
				"<boolean name='flip_tex_coords' value='%s'/><bsdf type='normalmap'>%s"
				"<boolean name='use_shadowing_function' value='false'/><boolean "
				"name='flip_invalid_normals' value='false'/><rgb name='normalmap' "
				"value='0.5,0.853553391,0.853553391'/><bsdf type='diffuse'/></bsdf></shape></scene>",
				up ? -1 : 1, cases[k].flip, cases[k].handed);
			assert_true(n < (int)sizeof xml);
			const struct memory_file files[] = {
				{"s.xml", xml, (size_t)n}, {"m.obj", obj, strlen(obj)}, {NULL, NULL, 0}};
			static double got[SIDE * SIDE], level[SIDE * SIDE];
			render_luminance(world_from_files(SIDE, SIDE, files), got);
			render_luminance(
				world_with_picture(
					VIEW "<emitter type='directional'><vector name='direction' x='0' y='0' z='-1'/>"
					     "</emitter><shape type='rectangle'/>"),
				level);
			int at = SIDE / 2 * SIDE + SIDE / 2;
			double share = got[at] / level[at];
			assert_true(fabs(share - (cases[k].up == (up == 1))) < 1e-3);
		}
}

/* Glass, metal and a matt ground, all with bent normals, in the light of a lamp and a sky. */
static void test_integrators_agree(void **state)
{
	(void)state;
/* clang-format off */
#define BUMP(scale, inner) \
	"<bsdf type='bumpmap'>" \
		"<float name='scale' value='" scale "'/>" \
		"<texture type='bitmap'>" PICTURE "</texture>" \
		inner \
	"</bsdf>"
	struct world *w = world_with_picture(
		"<integrator type='path'><integer name='max_depth' value='4'/></integrator>"
		SENSOR("0,3.5,4", "0,0.5,0")
		"<shape type='rectangle'>"
			"<transform name='to_world'><scale value='4'/><rotate x='1' angle='-90'/></transform>"
			BUMP("0.2", "<bsdf type='diffuse'/>")
		"</shape>"
		"<shape type='sphere'>"
			"<point name='center' x='-0.9' y='0.9' z='0'/>"
			"<float name='radius' value='0.8'/>"
			BUMP("0.05", "<bsdf type='roughconductor'><float name='alpha' value='0.2'/></bsdf>")
		"</shape>"
		"<shape type='sphere'>"
			"<point name='center' x='0.9' y='0.9' z='0'/>"
			"<float name='radius' value='0.8'/>"
			BUMP("0.02", "<bsdf type='roughdielectric'><float name='alpha' value='0.3'/></bsdf>")
		"</shape>"
		"<shape type='rectangle'>"
			"<transform name='to_world'>"
				"<scale value='3'/>"
				"<rotate x='1' angle='90'/>"
				"<translate y='5'/>"
			"</transform>"
			"<emitter type='area'><float name='radiance' value='2'/></emitter>"
		"</shape>"
		"<emitter type='constant'><float name='radiance' value='0.5'/></emitter>");
	/* clang-format on */
	static struct agreement_image path, other;
	agreement_render(w, __func__, "path", &(struct agreement_options){"path", 1280, 32, 0, 0}, &path);
	agreement_render(w, __func__, "bdpt", &(struct agreement_options){"bdpt", 1280, 32, 0, 0}, &other);
	agreement_check(__func__, &other, &path);
	agreement_render(w, __func__, "hslt", &(struct agreement_options){"hslt", 320, 32, 0, 0}, &other);
	agreement_check_any_power(__func__, &other, &path);
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_bump_map_matches_geometry),
		cmocka_unit_test(test_normal_maps_have_the_right_y),
		cmocka_unit_test(test_integrators_agree),
	};
	return cmocka_run_group_tests_name("relief", tests, NULL, NULL);
}
