/* SPDX-License-Identifier: Apache-2.0 */
/*
 * point_inverse is the inverse of sample_point, and the density is one over the area that a square of random numbers
 * covers, by central differences of step h (errors h^2 and eps / h). Deterministic.
 */
#include "tests/support/dice.h"
#include "tests/support/memory_assets.h"
#include "tests/support/nodes.h"
#include "tests/support/pictures.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

static struct emitter_point draw_emitter_point(const struct emitter *em, double u0, double u1)
{
	struct emitter_point x;
	double pdf;
	assert_true(em->ops->sample_point(em, (double[]){u0, u1}, &x, &pdf));
	return x;
}

static double numeric_jacobian(const struct emitter *em, const double u[2], double pdf, double h)
{
	struct emitter_point a[4] = {draw_emitter_point(em, u[0] - h, u[1]), draw_emitter_point(em, u[0] + h, u[1]),
				     draw_emitter_point(em, u[0], u[1] - h), draw_emitter_point(em, u[0], u[1] + h)};
	/* Differences must not cross the borders of triangles or cells. */
	for (int i = 0; i < 4; i++)
		if (a[i].texture_point.prim != a[0].texture_point.prim ||
		    fabs(em->ops->pdf_point(em, &a[i]) / pdf - 1) > 1e-9)
			return NAN;
	vec3 d0 = vec3_sub(a[1].p, a[0].p), d1 = vec3_sub(a[3].p, a[2].p);
	return vec3_length(vec3_cross(d0, d1)) / (4 * h * h);
}

static void check_inverse(const char *name, const struct emitter *em, double share)
{
	struct dice d = dice_for_test(name);
	size_t n = dice_scaled_count(40000), slopes = 0;
	double worst = 0, worst_slope = 0;
	assert_false(em->is_delta);
	for (size_t i = 0; i < n; i++) {
		double u[2] = {dice_uniform(&d), dice_uniform(&d)}, back[2], pdf;
		struct emitter_point x, y;
		assert_true(em->ops->sample_point(em, u, &x, &pdf));
		em->ops->point_inverse(em, &x, back);
		assert_true(back[0] >= 0 && back[0] < 1 && back[1] >= 0 && back[1] < 1);
		y = draw_emitter_point(em, back[0], back[1]);
		assert_true(y.is_infinite == x.is_infinite &&
			    (x.is_infinite || y.texture_point.prim == x.texture_point.prim));
		worst = fmax(worst, vec3_length(vec3_sub(x.p, y.p)));
		if (fabs(u[0] - 0.5) > 0.499 || fabs(u[1] - 0.5) > 0.499)
			continue;
		/* Only where steps of two lengths agree: the map has square roots at the corners of triangles. */
		double area = numeric_jacobian(em, u, pdf, 1e-6), area2 = numeric_jacobian(em, u, pdf, 2e-6);
		if (fabs(area / area2 - 1) < 1e-5) {
			worst_slope = fmax(worst_slope, fabs(area * pdf - 1));
			slopes++;
		}
	}
	print_message("%s: there and back to %.1e, density to %.1e (%zu of %zu)\n", name, worst, worst_slope, slopes,
		      n);
	assert_true(worst < 1e-9);
	assert_true(worst_slope < 1e-4);
	assert_true((double)slopes > share * (double)n);
	const double ends[] = {0, 0x1p-53, 0.5, 1 - 0x1p-53};
	for (int i = 0; i < 16; i++) {
		double u[2], pdf;
		struct emitter_point x;
		if (!em->ops->sample_point(em, (double[]){ends[i % 4], ends[i / 4]}, &x, &pdf))
			continue;
		em->ops->point_inverse(em, &x, u);
		assert_true(u[0] >= 0 && u[0] < 1 && u[1] >= 0 && u[1] < 1);
		/* At the pole where numbers are coarse, 2^-53 of the area is a circle of radius 1e-8. */
		struct emitter_point y = draw_emitter_point(em, u[0], u[1]);
		assert_true(vec3_length(vec3_sub(x.p, y.p)) < 1e-7);
	}
}

static void test_area_samples_are_inverted(void **state)
{
	(void)state;
	struct world *w = world_from_text(
		8, 8,
		SENSOR("0,0,9",
		       "0,0,0") "<shape type='rectangle'><transform name='to_world'><scale x='3' y='.2'/>"
				"<rotate x='1' y='1' angle='50'/><translate x='2'/></transform><emitter type='area'/></shape>"
				"<shape type='sphere'><point name='center' x='.25' y='-.5' z='.125'/><float name='radius' value='.5'/>"
				"<boolean name='flip_normals' value='true'/><emitter type='area'/></shape>");
	check_inverse("rectangle", &w->emitters[0], 0.99);
	check_inverse("sphere", &w->emitters[1], 0.99);
	world_free(w);
	/* Triangles with areas of about 1 : 18 : 1300, one of them upright, and one a sliver. */
	static const char scene[] = "<scene version='3.0.0'>" SENSOR(
		"0,0,9",
		"0,0,0") "<shape type='obj'><string name='filename' value='few.obj'/><emitter type='area'/></shape></scene>";
	static const char few[] =
		"v 0 0 0\nv .02 0 0\nv 0 .1 0\nv 1 1 0\nv 1.1 1 .01\nv 1 1.2 .3\nv -1 -1 0\nv 1 -1 .5\nv 0 -1.1 -1\n"
		"v 0 2 0\nv 3 2 0\nv 1 2.0002 0\nf 1 2 3\nf 4 5 6\nf 7 8 9\nf 10 11 12\n";
	const struct memory_file files[] = {
		{"few.xml", scene, sizeof scene - 1}, {"few.obj", few, sizeof few - 1}, {NULL, NULL, 0}};
	w = world_from_files(8, 8, files);
	check_inverse("mesh", &w->emitters[0], 0.99);
	world_free(w);
}

static void test_infinite_samples_are_inverted(void **state)
{
	(void)state;
	enum { WIDTH = 8, HEIGHT = 6 };
	struct arena arena = {0};
	struct pictures pictures = {.count = 0};
	double rgb[WIDTH * HEIGHT * 3];
	for (int i = 0; i < WIDTH * HEIGHT * 3; i++)
		rgb[i] = ldexp(1, i / 3 * 7 % 11 - 5);
	pictures_add(&pictures, WIDTH, HEIGHT, rgb);
	/* A single bright pixel, so that there are cells and rows without light. */
	memset(rgb, 0, sizeof rgb);
	rgb[3 * (3 * WIDTH + 2)] = rgb[3 * (3 * WIDTH + 2) + 1] = rgb[3 * (3 * WIDTH + 2) + 2] = 2;
	pictures_add(&pictures, WIDTH, HEIGHT, rgb);
	struct asset_source source = pictures_source(&pictures);
	static const char *const texts[] = {"constant", "envmap filename=p0", "envmap filename=p1"};
	const mat4 turn = mat4_rotate((vec3){1, 2, 3}, 40);
	for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
		struct scene_node *n = node_make(&arena, PLUGIN_EMITTER, texts[i]);
		const struct emitter_build build = {
			.assets = &source, .arena = &arena, .is_dialect_3 = true, .world_scale = 1};
		if (i)
			node_add_transform(&arena, n, "to_world", turn);
		struct emitter em;
		struct error e;
		if (emitter_create(&em, n, &build, &e))
			fail_msg("%s: %s", texts[i], e.text);
		check_inverse(texts[i], &em, 0.95);
	}
	pictures_fini(&pictures);
	arena_fini(&arena);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_area_samples_are_inverted),
					   cmocka_unit_test(test_infinite_samples_are_inverted)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
