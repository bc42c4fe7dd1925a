/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Area emitters: samples are distributed as the pdf functions say, and these integrate to one. Chi-square tests at
 * level 1e-6 each, over cells of the (u,v) square of the emitter's surface; seeds are the hash of the test's name. A
 * density wrong by 3 % in a tenth of the cells raises chi-square by 0.1 x 0.03^2 x 200000 = 18 above its 96 degrees of
 * freedom: chi-square finds it if it is concentrated in few cells, the integral always does.
 */
#include "tests/support/bodies.h"
#include "tests/support/memory_assets.h"
#include "tests/support/stats.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

enum { CELLS = 16 }; /* squared */
#define LEVEL 1e-6

static struct world *sphere_light(const char *flip)
{
	return world_from_text(
		8, 8,
		SENSOR("0,0,9",
		       "0,0,0") "<shape type='sphere'><point name='center' x='.25' y='-.5' z='.125'/>"
				"<float name='radius' value='.5'/><boolean name='flip_normals' value='%s'/>"
				"<emitter type='area'/></shape><shape type='sphere'><float name='radius' value='4'/></shape>",
		flip);
}

/* Three triangles with areas of about 1 : 18 : 1300, one of them upright. */
static struct world *mesh_light(void)
{
	static const char scene[] = "<scene version='3.0.0'>" SENSOR(
		"0,0,9",
		"0,0,0") "<shape type='obj'><string name='filename' value='three.obj'/><emitter type='area'/></shape></scene>";
	static const char three[] =
		"v 0 0 0\nv .02 0 0\nv 0 .1 0\nv 1 1 0\nv 1.1 1 .01\nv 1 1.2 .3\nv -1 -1 0\nv 1 -1 .5\nv 0 -1.1 -1\n"
		"f 1 2 3\nf 4 5 6\nf 7 8 9\n";
	const struct memory_file files[] = {
		{"three.xml", scene, sizeof scene - 1}, {"three.obj", three, sizeof three - 1}, {NULL, NULL, 0}};
	return world_from_files(8, 8, files);
}

static void check_counts(const char *what, const uint64_t *counts, const double *expected, size_t cells)
{
	double p = stats_counts_p(counts, expected, cells);
	print_message("%s: p = %.3g\n", what, p);
	if (p < LEVEL)
		fail_msg("%s: p = %g", what, p);
}

/* Returns the cell of a point of a sphere in (height, longitude); cells have equal areas. */
static size_t sphere_cell(vec3 w)
{
	double u = 0.5 * (1 - w.z), v = atan2(w.y, w.x) / (2 * M_PI) + 0.5;
	size_t i = (size_t)fmin(u * CELLS, CELLS - 1), j = (size_t)fmin(v * CELLS, CELLS - 1);
	return i * CELLS + j;
}

static vec3 cell_direction(double i, double j)
{
	double z = 1 - 2 * i / CELLS, phi = 2 * M_PI * (j / CELLS - 0.5), r = sqrt(fmax(1 - z * z, 0));
	return (vec3){r * cos(phi), r * sin(phi), z};
}

/* Computes the expected counts of a density over directions (per solid angle) by the midpoint rule, 16 x 16 points per
 * cell; returns their sum. */
static double expect_counts(double (*density)(const void *, vec3), const void *arg, double n, double *expected)
{
	enum { SUB = 16 };
	double sum = 0;
	for (int i = 0; i < CELLS; i++)
		for (int j = 0; j < CELLS; j++) {
			double cell = 0;
			for (int k = 0; k < SUB * SUB; k++)
				cell += density(arg,
						cell_direction(i + (k / SUB + 0.5) / SUB, j + (k % SUB + 0.5) / SUB));
			expected[i * CELLS + j] = n * cell * 4 * M_PI / (CELLS * CELLS * SUB * SUB);
			sum += expected[i * CELLS + j] / n;
		}
	return sum;
}

struct seen {
	const struct emitter *em;
	const struct geom_shape *shape;
	vec3 ref;
};

static struct emitter_point sphere_point(const struct seen *s, vec3 w)
{
	return (struct emitter_point){.p = vec3_madd(s->shape->center, s->shape->radius, w),
				      .n = vec3_scale(s->shape->normal_sign, w)};
}

/* The density per solid angle of directions from the centre. */
static double directional_density(const void *arg, vec3 w)
{
	const struct seen *s = arg;
	struct emitter_point x = sphere_point(s, w);
	return emitter_pdf_toward(s->em, s->ref, &x) * s->shape->radius * s->shape->radius;
}

static double point_density(const void *arg, vec3 w)
{
	const struct seen *s = arg;
	struct emitter_point x = sphere_point(s, w);
	return s->em->ops->pdf_point(s->em, &x) * s->shape->radius * s->shape->radius;
}

static void check_sphere(const char *what, const struct seen *s, bool toward, double tolerance)
{
	static uint64_t counts[CELLS * CELLS];
	static double expected[CELLS * CELLS];
	memset(counts, 0, sizeof counts);
	struct dice d = dice_for_test(what);
	size_t n = dice_scaled_count(200000), taken = 0;
	for (size_t i = 0; i < n; i++) {
		double u[2] = {dice_uniform(&d), dice_uniform(&d)}, pdf;
		struct emitter_point x = {0};
		bool ok = toward ? emitter_sample_toward(s->em, s->ref, u, &x, &pdf)
				 : s->em->ops->sample_point(s->em, u, &x, &pdf);
		if (!ok)
			continue;
		taken++;
		vec3 w = vec3_scale(1 / s->shape->radius, vec3_sub(x.p, s->shape->center));
		assert_true(fabs(vec3_length(w) - 1) < 1e-12);
		assert_true(fabs(vec3_dot(w, x.n) - s->shape->normal_sign) < 1e-12);
		double own = toward ? emitter_pdf_toward(s->em, s->ref, &x) : s->em->ops->pdf_point(s->em, &x);
		assert_true(fabs(own - pdf) <= 1e-9 * pdf);
		counts[sphere_cell(w)]++;
	}
	/* Only the silhouette itself, a set of measure zero, may be refused. */
	assert_true(n - taken <= n / 10000);
	double sum = expect_counts(toward ? directional_density : point_density, s, (double)taken, expected);
	print_message("%s: integral %.6f\n", what, sum);
	/* The midpoint rule is inexact at the border of the cap. */
	assert_true(fabs(sum - 1) < tolerance);
	if (tolerance < 0.001)
		check_counts(what, counts, expected, CELLS * CELLS);
}

static void test_points_on_a_sphere_follow_the_density(void **state)
{
	(void)state;
	for (int flip = 0; flip < 2; flip++) {
		struct world *w = sphere_light(flip ? "true" : "false");
		struct seen s = {&w->emitters[0], &w->shapes[0], {0, 0, 0}};
		check_sphere(flip ? "point, inwards" : "point", &s, false, 1e-9);
		s.ref = s.shape->center;
		check_sphere(flip ? "toward, from the centre, inwards" : "toward, from the centre", &s, true, 1e-9);
		if (flip) {
			s.ref = vec3_add(s.shape->center, (vec3){0, 2 * s.shape->radius, 0});
			check_sphere("toward, inwards, from outside", &s, true, 1e-9);
		}
		world_free(w);
	}
}

/* Over the visible cap, cells in the numbers of the sampled cone must fill evenly. The cosine in the cone is computed
 * from the sampled point, so that a wrong angle, a wrong side or a wrong density is found. */
static void check_cone(const char *what, const struct seen *s)
{
	enum { RINGS = 64 };
	uint64_t counts[RINGS] = {0};
	double expected[RINGS], integral = 0, r = s->shape->radius;
	vec3 to = vec3_sub(s->shape->center, s->ref);
	double distance = vec3_length(to);
	vec3 axis = vec3_scale(1 / distance, to);
	struct dice d = dice_for_test(what);
	size_t n = dice_scaled_count(200000), refused = 0;
	for (size_t i = 0; i < n; i++) {
		double u[2] = {dice_uniform(&d), dice_uniform(&d)}, pdf;
		struct emitter_point x;
		if (!emitter_sample_toward(s->em, s->ref, u, &x, &pdf)) {
			refused++;
			continue;
		}
		double own = emitter_pdf_toward(s->em, s->ref, &x);
		assert_true(fabs(own - pdf) <= 1e-9 * pdf);
		/* The point faces ref: r n = x - c, and ref sees x if (ref - x).n > 0. */
		assert_true(vec3_dot(vec3_sub(s->ref, x.p), x.n) > 0);
		/* Angle at the centre, as a share of the visible cap, whose height is r - r^2 / d. */
		double height = (1 + vec3_dot(x.n, axis)) / (1 - r / distance);
		assert_true(height < 1 + 1e-6);
		counts[(size_t)fmin(height * RINGS, RINGS - 1)]++;
	}
	/* Density over the height: pdf_toward is per area, areas are 2 pi r^2 per height. */
	struct frame f = frame_around(vec3_neg(axis));
	for (int i = 0; i < RINGS; i++) {
		enum { SUB = 2000 };
		double sum = 0;
		for (int k = 0; k < SUB; k++) {
			double h = (i + (k + 0.5) / SUB) / RINGS * (1 - r / distance), c = 1 - h,
			       sine = sqrt(h * (2 - h));
			vec3 w = frame_to_world(&f, (vec3){sine, 0, c});
			struct emitter_point x = sphere_point(s, w);
			sum += emitter_pdf_toward(s->em, s->ref, &x) / SUB;
		}
		double share = sum * 2 * M_PI * r * r * (1 - r / distance) / RINGS;
		integral += share;
		expected[i] = (double)(n - refused) * share;
	}
	print_message("%s: integral %.9f, %zu of %zu refused\n", what, integral, refused, n);
	/* Near the surface, almost all of the density is in the first ring, where the rule is coarser. */
	assert_true(fabs(integral - 1) < 1e-3);
	assert_true(refused <= n / 1000);
	for (int i = 0; i < RINGS; i++)
		expected[i] /= integral;
	check_counts(what, counts, expected, RINGS);
}

static void test_visible_cap_is_sampled_evenly(void **state)
{
	(void)state;
	struct world *w = sphere_light("false");
	struct seen s = {&w->emitters[0], &w->shapes[0], {0, 0, 0}};
	const double gaps[] = {1e-3, 0.1, 1, 10, 1e3, 1e6};
	static const char *const names[] = {"cone, near the surface", "cone at 0.1 radii", "cone at 1 radius",
					    "cone at 10 radii",	      "cone at 1e3 radii", "cone at 1e6 radii"};
	for (size_t i = 0; i < sizeof gaps / sizeof gaps[0]; i++) {
		vec3 away = vec3_normalize((vec3){1, -2, 3});
		s.ref = vec3_madd(s.shape->center, s.shape->radius * (1 + gaps[i]), away);
		check_cone(names[i], &s);
	}
	world_free(w);
}

static double cosine_density(const void *arg, vec3 w)
{
	const struct seen *s = arg;
	struct emitter_point x = {.n = s->ref};
	return s->em->ops->pdf_direction(s->em, &x, w);
}

/* back_share: the share of directions against the normal; unless it is 0, both sides emit alike. */
static void check_direction(const char *what, struct world *w, double back_share)
{
	static uint64_t counts[CELLS * CELLS];
	static double expected[CELLS * CELLS];
	memset(counts, 0, sizeof counts);
	struct seen s = {&w->emitters[0], NULL, vec3_normalize((vec3){0.3, -0.8, 0.4})};
	struct emitter_point x = {.n = s.ref};
	struct wavelengths wl = {.is_grey = true};
	struct dice d = dice_for_test(what);
	size_t n = dice_scaled_count(400000);
	double behind = 0;
	for (size_t i = 0; i < n; i++) {
		double u[2] = {dice_uniform(&d), dice_uniform(&d)}, pdf;
		vec3 dir;
		assert_true(s.em->ops->sample_direction(s.em, &x, u, &dir, &pdf));
		assert_true(fabs(vec3_length(dir) - 1) < 1e-12);
		assert_true(fabs(pdf - s.em->ops->pdf_direction(s.em, &x, dir)) < 1e-12);
		double ahead = s.em->ops->radiance(s.em, &x, dir, &wl).v[0],
		       opposite = s.em->ops->radiance(s.em, &x, vec3_neg(dir), &wl).v[0];
		assert_true(ahead > 0 && opposite == (back_share > 0 ? ahead : 0));
		counts[sphere_cell(dir)]++;
		behind += vec3_dot(dir, x.n) < 0;
	}
	double sum = expect_counts(cosine_density, &s, (double)n, expected);
	assert_true(fabs(sum - 1) < 1e-4);
	check_counts(what, counts, expected, CELLS * CELLS);
	assert_true(fabs(behind / (double)n - back_share) <= 6 * sqrt(back_share * (1 - back_share) / (double)n));
	world_free(w);
}

#define TWO_SIDED(shape)                                                                                          \
	SENSOR("0,0,3", "0,0,0")                                                                                  \
	"<shape type='" shape "'><emitter type='area'><boolean name='two_sided' value='true'/></emitter></shape>" \
	"<shape type='sphere'><float name='radius' value='4'/></shape>"

/* If the surface encloses a body smaller than the scene, few directions are sampled against the normal; otherwise half
 * of them. The power is that of two sides. */
static void test_directions_follow_the_cosine(void **state)
{
	(void)state;
	check_direction("direction", sphere_light("false"), 0);
	check_direction("direction, two sides of a rectangle", world_from_text(8, 8, TWO_SIDED("rectangle")), 0.5);
	check_direction("direction, two sides of a cube", world_from_text(8, 8, TWO_SIDED("cube")), 0.0625);
	check_direction(
		"direction, two sides of a dome",
		world_from_text(
			8, 8,
			SENSOR("0,0,3",
			       "0,0,0") "<shape type='sphere'><float name='radius' value='4'/><emitter type='area'>"
					"<boolean name='twosided' value='true'/></emitter></shape>"),
		0.5);
	struct world *w[2] = {
		world_from_text(8, 8, TWO_SIDED("cube")),
		world_from_text(
			8, 8,
			SENSOR("0,0,3", "0,0,0") "<shape type='cube'><emitter type='area'/></shape>"
						 "<shape type='sphere'><float name='radius' value='4'/></shape>")};
	assert_true(w[1]->emitters[0].power > 0 && w[0]->emitters[0].power == 2 * w[1]->emitters[0].power);
	world_free(w[0]);
	world_free(w[1]);
}

/* Triangles are chosen by area, and points evenly within each: the four parts of a triangle, cut at its midpoints, get
 * equal counts. */
static void test_triangles_are_sampled_by_area(void **state)
{
	(void)state;
	struct world *w = mesh_light();
	const struct emitter *em = &w->emitters[0];
	const struct geom_shape *g = &w->shapes[0];
	assert_int_equal(g->triangle_count, 3);
	double area[3], total = 0, expected[12];
	uint64_t counts[12] = {0};
	vec3 corner[3][3];
	for (int i = 0; i < 3; i++) {
		for (int k = 0; k < 3; k++) {
			const float *p = g->position[g->index[i][k]];
			corner[i][k] = (vec3){(double)p[0], (double)p[1], (double)p[2]};
		}
		area[i] = 0.5 * vec3_length(vec3_cross(vec3_sub(corner[i][1], corner[i][0]),
						       vec3_sub(corner[i][2], corner[i][0])));
		total += area[i];
	}
	assert_true(area[2] > 50 * area[1] && area[1] > 5 * area[0]);
	struct dice d = dice_for_test("mesh");
	size_t n = dice_scaled_count(1000000);
	for (size_t i = 0; i < n; i++) {
		double u[2] = {dice_uniform(&d), dice_uniform(&d)}, pdf;
		struct emitter_point x;
		assert_true((i % 2 ? em->ops->sample_point(em, u, &x, &pdf)
				   : emitter_sample_toward(em, (vec3){0, 0, 1}, u, &x, &pdf)));
		assert_true(x.texture_point.prim < 3);
		assert_true(fabs(pdf * total - 1) < 1e-12 && fabs(em->ops->pdf_point(em, &x) * total - 1) < 1e-12);
		assert_true(emitter_pdf_toward(em, (vec3){0, 0, 1}, &x) == pdf);
		vec3 *c = corner[x.texture_point.prim], normal = vec3_cross(vec3_sub(c[1], c[0]), vec3_sub(c[2], c[0]));
		double l2 = vec3_dot(normal, normal), b[3];
		assert_true(fabs(vec3_dot(vec3_sub(x.p, c[0]), normal)) < 1e-12 * sqrt(l2));
		assert_true(vec3_length(vec3_sub(x.n, vec3_scale(1 / sqrt(l2), normal))) < 1e-12);
		for (int k = 0; k < 3; k++) {
			b[k] = vec3_dot(vec3_cross(vec3_sub(c[(k + 1) % 3], x.p), vec3_sub(c[(k + 2) % 3], x.p)),
					normal) /
			       l2;
			assert_true(b[k] > -1e-9);
		}
		counts[4 * x.texture_point.prim + (b[0] > 0.5 ? 0 : b[1] > 0.5 ? 1 : b[2] > 0.5 ? 2 : 3)]++;
	}
	for (int i = 0; i < 12; i++)
		expected[i] = (double)n * area[i / 4] / (4 * total);
	check_counts("mesh", counts, expected, 12);
	world_free(w);
}

/* Random numbers on the border of the unit square give points, too. */
static void test_border_numbers_give_points(void **state)
{
	(void)state;
	struct world *w[2] = {sphere_light("false"), mesh_light()};
	const double ends[] = {0, 0x1p-53, 0.5, 1 - 0x1p-53};
	for (int k = 0; k < 2; k++) {
		const struct emitter *em = &w[k]->emitters[0];
		for (int i = 0; i < 16; i++) {
			double u[2] = {ends[i / 4], ends[i % 4]}, pdf;
			struct emitter_point x;
			vec3 dir;
			assert_true(em->ops->sample_point(em, u, &x, &pdf) && pdf > 0 && isfinite(pdf));
			assert_true(vec3_is_finite(x.p) && fabs(vec3_length(x.n) - 1) < 1e-12);
			if (em->ops->sample_direction(em, &x, u, &dir, &pdf))
				assert_true(pdf > 0 && fabs(vec3_length(dir) - 1) < 1e-9 && vec3_dot(dir, x.n) > 0);
			if (emitter_sample_toward(em, (vec3){0.9, 0.9, 0.9}, u, &x, &pdf))
				assert_true(pdf > 0 && isfinite(pdf) && vec3_is_finite(x.p));
		}
		world_free(w[k]);
	}
}

/* A texture on the light has the same value whether a point is sampled, sampled towards another point, or hit by a
 * ray. */
static void test_texture_coordinates_agree_with_rays(void **state)
{
	(void)state;
	struct world *w = world_from_text(
		8, 8,
		SENSOR("0,0,9",
		       "0,0,0") "<shape type='sphere'><transform name='to_world'>"
				"<rotate x='1' y='2' z='.5' angle='70'/><translate x='.25' y='-.5'/></transform>"
				"<emitter type='area'/></shape><shape type='sphere'><float name='radius' value='4'/></shape>");
	const struct emitter *em = &w->emitters[0];
	const struct geom_shape *s = &w->shapes[w->emitter_shapes[0]];
	for (int i = 0; i < 64; i++) {
		const double u[2] = {(i % 8 + 0.3) / 8, (i / 8 + 0.6) / 8};
		struct emitter_point x[2];
		struct surface_point there;
		double pdf;
		assert_true(em->ops->sample_point(em, u, &x[0], &pdf));
		assert_true(emitter_sample_toward(em, (vec3){0.9, 0.3, -0.2}, u, &x[1], &pdf));
		for (int k = 0; k < 2; k++) {
			surface_on_sphere(s, (struct prim_ref){0, 0, 0}, vec3_normalize(vec3_sub(x[k].p, s->center)),
					  &there);
			assert_true(fabs(there.u - x[k].texture_point.u) < 1e-9 &&
				    fabs(there.v - x[k].texture_point.v) < 1e-9);
		}
	}
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_points_on_a_sphere_follow_the_density),
		cmocka_unit_test(test_visible_cap_is_sampled_evenly),
		cmocka_unit_test(test_directions_follow_the_cosine),
		cmocka_unit_test(test_triangles_are_sampled_by_area),
		cmocka_unit_test(test_border_numbers_give_points),
		cmocka_unit_test(test_texture_coordinates_agree_with_rays),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
