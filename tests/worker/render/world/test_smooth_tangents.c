/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Interpolated tangents: on the mesh of a sphere, against the sphere's own dp/du, which they approach as the mesh is
 * refined; their weights; mirrored texture coordinates; triangles without shared vertices, or without area in the
 * texture; and that only materials which use tangents get them.
 */
#include "tests/support/dice.h"
#include "tests/support/memory_assets.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define METAL(v) \
	"<bsdf type='roughconductor'><float name='alpha_u' value='0.3'/><float name='alpha_v' value='" v "'/></bsdf>"

static struct world *world_with(const char *obj, const char *bsdf)
{
	char xml[2048];
	int n = snprintf(xml, sizeof xml,
			 "<scene version='3.0.0'>" SENSOR(
				 "0,0,5", "0,0,0") "<emitter type='constant'/><shape type='obj'>"
						   "<string name='filename' value='m.obj'/>%s</shape></scene>",
			 bsdf);
	assert_true(n < (int)sizeof xml);
	const struct memory_file files[] = {{"s.xml", xml, (size_t)n}, {"m.obj", obj, strlen(obj)}, {NULL, NULL, 0}};
	return world_from_files(8, 8, files);
}

/* Returns the unit sphere with n meridians and n / 2 circles; each triangle has its own vertices. */
static const char *make_sphere_obj(int n)
{
	static char text[1 << 22];
	size_t at = 0;
	int vertices = 0;
	for (int j = 0; j < n / 2; j++)
		for (int i = 0; i < 6 * n; i++) {
			static const int corner[6][2] = {{0, 0}, {0, 1}, {1, 0}, {1, 0}, {0, 1}, {1, 1}};
			int k = i % 6, right = i / 6 + corner[k][0], down = j + corner[k][1];
			if (j == (k < 3 ? 0 : n / 2 - 1)) /* this triangle has no area at the pole */
				continue;
			double u = (double)right / n, v = 2.0 * down / n, x = sin(M_PI * v) * cos(2 * M_PI * u),
			       y = sin(M_PI * v) * sin(2 * M_PI * u), z = cos(M_PI * v);
			at += (size_t)snprintf(text + at, sizeof text - at,
					       "v %.9g %.9g %.9g\nvt %.9g %.9g\nvn %.9g %.9g %.9g\n", x, y, z, u, v, x,
					       y, z);
			vertices++;
			if (k % 3 == 2)
				at += (size_t)snprintf(text + at, sizeof text - at, "f %d/%d/%d %d/%d/%d %d/%d/%d\n",
						       vertices - 2, vertices - 2, vertices - 2, vertices - 1,
						       vertices - 1, vertices - 1, vertices, vertices, vertices);
		}
	assert_true(at < sizeof text);
	return text;
}

/* Returns the largest angle between the frame's first axis and the sphere's dp/du, away from the poles and from the
 * seam of u, where tangents average over one side only. */
static double max_frame_rotation(const struct world *w, bool smooth, int n)
{
	struct dice d = dice_for_test("points of a sphere");
	struct geom_shape s = w->shapes[0];
	double worst = 0;
	if (!smooth)
		s.tangent = NULL;
	for (int i = 0; i < 4000; i++) {
		struct surface_point x;
		double root = sqrt(dice_uniform(&d));
		surface_on_triangle(&s, (struct prim_ref){0, dice_below(&d, s.triangle_count), 0}, 1 - root,
				    root * dice_uniform(&d), &x);
		vec3 east = vec3_normalize((vec3){-x.sh.n.y, x.sh.n.x, 0});
		if (fabs(x.sh.n.z) < 0.5 && fabs(atan2(x.sh.n.y, x.sh.n.x)) > 4 * M_PI / n)
			worst = fmax(worst, atan2(fabs(vec3_dot(x.sh.t, east)), vec3_dot(x.sh.s, east)));
	}
	return worst;
}

static void test_tangents_of_a_sphere_are_smooth(void **state)
{
	(void)state;
	double before = 0;
	for (int n = 16; n <= 64; n *= 2) {
		struct world *w = world_with(make_sphere_obj(n), METAL("0.1"));
		assert_non_null(w->shapes[0].tangent);
		double smooth = max_frame_rotation(w, true, n), flat = max_frame_rotation(w, false, n);
		print_message("%d meridians: frames are off by %.4f, without tangents by %.4f\n", n, smooth, flat);
		/* The error with tangents is of second order in the size of the triangles, the error without them of
		 * first order. */
		assert_true(smooth < 0.2 * flat && flat > 0.4 * M_PI / n);
		assert_true(n == 16 || smooth < 0.35 * before);
		before = smooth;
		world_free(w);
	}
}

static void test_only_materials_that_need_tangents_have_them(void **state)
{
	(void)state;
	static const struct {
		const char *bsdf;
		bool needs_tangents;
	} cases[] = {
		{METAL("0.3"), false},
		{METAL("0.1"), true},
		{"<bsdf type='twosided'>" METAL("0.1") "</bsdf>", true},
		{"<bsdf type='mask'>" METAL("0.1") "</bsdf>", true},
		{"<bsdf type='coating'>" METAL("0.1") "</bsdf>", true},
		{"<bsdf type='bumpmap'><texture type='checkerboard'/>" METAL("0.1") "</bsdf>", true},
		{"<bsdf type='bumpmap'><texture type='checkerboard'/>" METAL("0.3") "</bsdf>", false},
		{"<bsdf type='normalmap'><rgb name='normalmap' value='0.6,0.5,0.9'/><bsdf type='diffuse'/></bsdf>",
		 true},
		{"<bsdf type='principled'><float name='anisotropic' value='0.5'/></bsdf>", true},
		{"<bsdf type='principled'/>", false},
		{"<bsdf type='roughconductor'><texture name='alpha_u' type='checkerboard'/></bsdf>", true},
		{"<bsdf type='roughconductor'><texture name='alpha' type='checkerboard'/></bsdf>", false},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct world *w = world_with(make_sphere_obj(8), cases[i].bsdf);
		if ((w->shapes[0].tangent != NULL) != cases[i].needs_tangents)
			fail_msg("%s", cases[i].bsdf);
		world_free(w);
	}
}

/* A strip along x from -1 to 1 with u = |x|, v = y: its two halves share the vertices at 0 and have opposite dp/du. A
 * triangle to the right has no area in the texture and takes its neighbours' tangents; another beyond it has no
 * neighbour. */
static void test_mirrored_halves_keep_their_tangents(void **state)
{
	(void)state;
	static const char strip[] = "v -1 0 0\nv 0 0 0\nv 1 0 0\nv -1 1 0\nv 0 1 0\nv 1 1 0\nv 2 0 0\nv 3 0 0\n"
				    "v 5 0 0\nv 6 0 0\nv 5 1 0\nvt 1 0\nvt 0 0\nvt 1 1\nvt 0 1\nvt 2 0\nvn 0 0 1\n"
				    "f 1/1/1 2/2/1 5/4/1\nf 1/1/1 5/4/1 4/3/1\n"
				    "f 2/2/1 3/1/1 6/3/1\nf 2/2/1 6/3/1 5/4/1\n"
				    "f 3/1/1 7/1/1 6/3/1\nf 7/1/1 8/5/1 6/3/1\nf 9/1/1 10/1/1 11/1/1\n";
	struct world *w = world_with(strip, METAL("0.1"));
	const struct geom_shape *s = &w->shapes[0];
	assert_int_equal(s->triangle_count, 7);
	for (uint32_t i = 0; i < 6; i++)
		for (int k = 0; k < 3; k++)
			assert_memory_equal(s->tangent[i][k], ((float[3]){i < 2 ? -1 : 1, 0, 0}), sizeof(float[3]));
	struct surface_point x;
	for (int k = 0; k < 3; k++)
		assert_memory_equal(s->tangent[6][k], ((float[3]){0, 0, 0}), sizeof(float[3]));
	surface_on_triangle(s, (struct prim_ref){0, 6, 0}, 0.3, 0.3, &x);
	assert_true(vec3_is_finite(x.sh.s) && vec3_length(x.sh.s) > 0.999);
	world_free(w);
}

/* Two triangles at a vertex, with dp/du along (1, 0) and (1, -1) and angles of 90 and 45 degrees. */
static void test_tangents_are_weighted_by_angles(void **state)
{
	(void)state;
	static const char fan[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvt -1 0\nvn 0 0 1\n"
				  "f 1/1/1 2/2/1 3/3/1\nf 1/1/1 3/3/1 4/4/1\n";
	struct world *w = world_with(fan, METAL("0.1"));
	vec3 want = vec3_normalize((vec3){2 + sqrt(0.5), -sqrt(0.5), 0});
	for (uint32_t i = 0; i < 2; i++) {
		const float *t = w->shapes[0].tangent[i][0];
		assert_true(vec3_length(vec3_sub((vec3){(double)t[0], (double)t[1], (double)t[2]}, want)) < 1e-6);
	}
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_tangents_of_a_sphere_are_smooth),
					   cmocka_unit_test(test_only_materials_that_need_tangents_have_them),
					   cmocka_unit_test(test_mirrored_halves_keep_their_tangents),
					   cmocka_unit_test(test_tangents_are_weighted_by_angles)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
