/* SPDX-License-Identifier: Apache-2.0 */
/*
 * SGGX microflakes are compared with a mirroring ellipsoid that has the same distribution of normals: parallel rays
 * that hit it, by intersection, are reflected about its normals. The share of rays that hit is its projected area, and
 * the reflected directions have the density of the phase function, by counts in bins of the sphere. Directions sampled
 * from the phase function have the same counts. (Level 1e-5 for each test of six ellipsoids, with 2^18 rays and 128
 * bins. Power: moving 3 % of every other bin to its neighbour is found for all ellipsoids.)
 *
 * Densities have an integral of 1, by quadrature; area times density is symmetric in both directions; equal eigenvalues
 * give the isotropic function.
 */
#include "tests/support/dice.h"
#include "tests/support/stats.h"
#include "worker/render/math/frame.h"
#include "worker/render/math/mat4.h"
#include "worker/render/medium/phase.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define LEVEL 1e-5

static const vec3 any_point = {0, 0, 0};

static struct phase make_phase(const double s[6])
{
	static struct arena arena;
	static struct phase p;
	const struct volume_build build = {.arena = &arena, .is_dialect_3 = true, .world_scale = 1};
	char text[200];
	struct error e;
	snprintf(text, sizeof text, "%.17g, %.17g, %.17g, %.17g, %.17g, %.17g", s[0], s[1], s[2], s[3], s[4], s[5]);
	const struct scene_node volume = {
		.cls = PLUGIN_VOLUME,
		.type = "constvolume",
		.property_count = 1,
		.properties = (const struct property[]){{"value", 1, {.type = VALUE_STRING, .as.string = text}}}};
	const struct scene_node phase = {
		.cls = PLUGIN_PHASE,
		.type = "sggx",
		.property_count = 1,
		.properties = (const struct property[]){{"S", 1, {.type = VALUE_NODE, .as.node = &volume}}}};
	if (phase_create(&p, &phase, &build, &e))
		fail_msg("%s", e.text);
	return p;
}

/* ---- ellipsoids ---- */

/* The points M u for u on the unit sphere. The normal there is n = C u, with the cofactors C of M, and the area element
 * |C u| du, so the projected area along w is pi |C^T w|, and S = C C^T up to that factor. */
struct ellipsoid {
	mat4 m, inverse;
	double s[6];
};

static vec3 row_cross_product(const mat4 *m, int i, int j)
{
	return vec3_cross((vec3){m->m[i][0], m->m[i][1], m->m[i][2]}, (vec3){m->m[j][0], m->m[j][1], m->m[j][2]});
}

static struct ellipsoid make_ellipsoid(vec3 axes, vec3 turn, double angle)
{
	struct ellipsoid e = {.m = mat4_mul(mat4_rotate(turn, angle), mat4_scale(axes))};
	assert_true(mat4_invert(e.m, &e.inverse));
	vec3 x = row_cross_product(&e.m, 1, 2), y = row_cross_product(&e.m, 2, 0), z = row_cross_product(&e.m, 0, 1);
	const double s[6] = {vec3_dot(x, x), vec3_dot(y, y), vec3_dot(z, z),
			     vec3_dot(x, y), vec3_dot(x, z), vec3_dot(y, z)};
	memcpy(e.s, s, sizeof s);
	return e;
}

static struct ellipsoid ellipsoid_case(int k)
{
	static const struct {
		vec3 axes, turn;
		double angle;
	} all[] = {{{1, 1, 1}, {0, 0, 1}, 0},	  {{1, 0.4, 0.7}, {0, 0, 1}, 0},  {{1, 0.4, 0.7}, {1, 2, 3}, 70},
		   {{1, 1, 0.2}, {1, -1, 1}, 50}, {{0.2, 0.2, 1}, {1, 0, 1}, 40}, {{2, 0.5, 1.5}, {0.3, 1, -2}, 200}};
	return make_ellipsoid(all[k].axes, vec3_normalize(all[k].turn), all[k].angle);
}
enum { ELLIPSOIDS = 6 };

/* Reflects a ray from `wo` with an offset. Returns false if it misses the ellipsoid. */
static bool reflect_ray(const struct ellipsoid *e, vec3 wo, vec3 offset, vec3 *wi)
{
	vec3 o = mat4_vector(&e->inverse, vec3_madd(offset, 100, wo)), d = mat4_vector(&e->inverse, vec3_neg(wo));
	double a = vec3_dot(d, d), b = vec3_dot(o, d), c = vec3_dot(o, o) - 1, root = b * b - a * c;
	if (root < 0)
		return false;
	vec3 n = vec3_normalize(mat4_normal(&e->inverse, vec3_madd(o, (-b - sqrt(root)) / a, d)));
	*wi = vec3_madd(vec3_neg(wo), 2 * vec3_dot(n, wo), n);
	return true;
}

/* ---- bins ---- */

enum { ROWS = 8, COLUMNS = 16, BINS = ROWS * COLUMNS };

static int bin_index(vec3 w)
{
	int row = (int)((w.z + 1) / 2 * ROWS), column = (int)((atan2(w.y, w.x) + M_PI) / (2 * M_PI) * COLUMNS);
	return (row < ROWS ? row : ROWS - 1) * COLUMNS + (column < COLUMNS ? column : COLUMNS - 1);
}

/* Computes the integral of the density over each bin, by the midpoint rule in the cosine and the azimuth; returns the
 * sum. */
static double expected_in_bins(const struct phase *p, vec3 wo, double expected[BINS])
{
	enum { FINE = 128 };
	double sum = 0, each = 4 * M_PI / BINS / (FINE * FINE);
	for (int row = 0; row < ROWS * FINE; row++)
		for (int column = 0; column < COLUMNS * FINE; column++) {
			double z = -1 + (row + 0.5) * 2 / (ROWS * FINE), r = sqrt(1 - z * z),
			       phi = -M_PI + (column + 0.5) * 2 * M_PI / (COLUMNS * FINE);
			double f = each * phase_eval(p, any_point, wo, (vec3){r * cos(phi), r * sin(phi), z});
			expected[row / FINE * COLUMNS + column / FINE] += f;
			sum += f;
		}
	return sum;
}

static double chi_square_p(const uint64_t counts[BINS], const double share[BINS], double sum, uint64_t total)
{
	double expected[BINS];
	for (int i = 0; i < BINS; i++)
		expected[i] = share[i] / sum * (double)total;
	return stats_counts_p(counts, expected, BINS);
}

static void check_ellipsoid(int k)
{
	struct ellipsoid e = ellipsoid_case(k);
	struct phase p = make_phase(e.s);
	struct dice d = dice_for_test("sggx");
	size_t rays = dice_scaled_count(1 << 18);
	d.seed += (uint64_t)k;
	vec3 wo = dice_direction(&d);
	struct frame across = frame_around(wo);
	double share[BINS] = {0}, sum = expected_in_bins(&p, wo, share), half = 2.2;
	uint64_t hits = 0, mirrored[BINS] = {0}, drawn[BINS] = {0};
	assert_true(fabs(sum - 1) < 1e-4);
	for (size_t i = 0; i < rays; i++) {
		vec3 wi, offset = frame_to_world(
				 &across, (vec3){dice_between(&d, -half, half), dice_between(&d, -half, half), 0});
		bool hit = reflect_ray(&e, wo, offset, &wi);
		hits += hit;
		mirrored[hit ? bin_index(wi) : 0] += hit;
		const double u[] = {dice_uniform(&d), dice_uniform(&d)};
		double pdf;
		wi = phase_sample(&p, any_point, wo, u, &pdf);
		assert_true(fabs(vec3_length(wi) - 1) < 1e-12);
		assert_true(pdf == phase_eval(&p, any_point, wo, wi));
		drawn[bin_index(wi)]++;
	}
	double area = M_PI * phase_area(&p, any_point, wo), chance = area / (4 * half * half),
	       error = sqrt(chance * (1 - chance) / (double)rays);
	double off = ((double)hits / (double)rays - chance) / error,
	       of_mirrors = chi_square_p(mirrored, share, sum, hits), of_drawn = chi_square_p(drawn, share, sum, rays);
	printf("ellipsoid %d: integral %.6f, area %+.2f standard errors (%.2f %%), p of its mirrors %.3g, of drawn ones "
	       "%.3g\n",
	       k, sum, off, 100 * error / chance, of_mirrors, of_drawn);
	assert_true(fabs(off) < 4.5 && of_mirrors > LEVEL && of_drawn > LEVEL);
	/* The test has the power stated above. */
	for (int i = 0; i < BINS / 2; i++) {
		share[2 * i] += 0.03 * share[2 * i + 1];
		share[2 * i + 1] *= 0.97;
	}
	if (rays >= 1 << 18)
		assert_true(chi_square_p(drawn, share, sum, rays) < LEVEL);
}

static void test_flakes_scatter_like_ellipsoids(void **state)
{
	(void)state;
	for (int k = 0; k < ELLIPSOIDS; k++)
		check_ellipsoid(k);
}

static void test_scattering_is_reciprocal(void **state)
{
	(void)state;
	struct dice d = dice_for_test("sggx both ways");
	for (int k = 0; k < ELLIPSOIDS; k++) {
		struct phase p = make_phase(ellipsoid_case(k).s);
		for (int i = 0; i < 1000; i++) {
			vec3 a = dice_direction(&d), b = dice_direction(&d);
			double one = phase_area(&p, any_point, a) * phase_eval(&p, any_point, a, b),
			       other = phase_area(&p, any_point, b) * phase_eval(&p, any_point, b, a);
			assert_true(fabs(one / other - 1) < 1e-9);
			assert_true(fabs(phase_area(&p, any_point, a) / phase_area(&p, any_point, vec3_neg(a)) - 1) <
				    1e-14);
		}
	}
}

static void test_sphere_scatters_isotropically(void **state)
{
	(void)state;
	struct dice d = dice_for_test("sggx isotropic");
	for (double c = 1e-6; c < 1e7; c *= 1e3) {
		struct phase p = make_phase((const double[6]){c, c, c, 0, 0, 0});
		for (int i = 0; i < 100; i++) {
			vec3 a = dice_direction(&d), b = dice_direction(&d);
			assert_true(fabs(phase_eval(&p, any_point, a, b) * 4 * M_PI - 1) < 1e-12);
			assert_true(fabs(phase_area(&p, any_point, a) / sqrt(c) - 1) < 1e-12);
		}
		assert_true(fabs(phase_eval(&p, any_point, (vec3){0, 0, 1}, (vec3){0, 0, -1}) * 4 * M_PI - 1) < 1e-12);
	}
}

/* Flakes in one plane or along one line are slightly rough; without flakes, light passes. */
static void test_degenerate_flakes_are_handled(void **state)
{
	(void)state;
	static const double flat[][6] = {
		{0, 0, 1, 0, 0, 0}, {1, 1, 0, 0, 0, 0}, {1, 1, 1, 1, 1, 1}, {1e12, 0, 0, 0, 0, 0}};
	for (size_t k = 0; k < sizeof flat / sizeof *flat; k++) {
		struct phase p = make_phase(flat[k]);
		struct dice d = dice_for_test("sggx flat");
		for (int i = 0; i < 1000; i++) {
			vec3 a = dice_direction(&d);
			const double u[] = {dice_uniform(&d), dice_uniform(&d)};
			double pdf;
			vec3 b = phase_sample(&p, any_point, a, u, &pdf);
			assert_true(isfinite(pdf) && pdf > 0 && fabs(vec3_length(b) - 1) < 1e-12);
			assert_true(phase_area(&p, any_point, a) > 0);
		}
	}
	/* The area of a mirror facing up, seen along w, is |w.z|. */
	struct phase p = make_phase(flat[0]);
	assert_true(fabs(phase_area(&p, any_point, (vec3){0.6, 0, 0.8}) - 0.8) < 1e-5);
	p = make_phase((const double[6]){0, 0, 0, 0, 0, 0});
	assert_true(phase_area(&p, any_point, (vec3){0, 0, 1}) == 0);
	assert_true(phase_eval(&p, any_point, (vec3){0, 0, 1}, (vec3){0, 1, 0}) == 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_flakes_scatter_like_ellipsoids),
		cmocka_unit_test(test_scattering_is_reciprocal),
		cmocka_unit_test(test_sphere_scatters_isotropically),
		cmocka_unit_test(test_degenerate_flakes_are_handled),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
