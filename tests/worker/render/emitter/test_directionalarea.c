/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Beams: each sampled direction carries the same power, densities integrate to one, and next event estimation gives the
 * irradiance that follows from the power per area alone: M from a plane, and M r^2 / d^2 at the distance d from the
 * centre of a sphere. tests/worker/render/path/test_closed_form.c has a floor under a beam.
 *
 * Irradiance is estimated with 40,000 samples, 8 standard errors with 15 degrees of freedom, below 1e-6 per test;
 * standard errors are below 0.2 %, so that an error of 2 % would be found. Integrals by the midpoint rule are exact to
 * 1e-4.
 */
#include "tests/support/bodies.h"
#include "tests/support/test_length.h"
#include "tests/support/memory_assets.h"
#include "tests/support/stats.h"
#include "tests/support/worlds.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>

#include <cmocka.h>

static const double power = 2.5, half_angle = 1e-3;
#define BEAM "<emitter type='directionalarea'><float name='radiance' value='2.5'/></emitter>"
#define EYE SENSOR("0,0,9", "0,0,0")
static const struct wavelengths grey = {.is_grey = true};

/* A world with one emitting shape, with the given contents. */
static struct world *make_beam(const char *shape, const char *more)
{
	return world_from_text(8, 8, EYE "<shape type='%s'>%s" BEAM "</shape>", shape, more);
}

/* A plane that is tilted and far from the origin, so that its corners are rounded. */
static struct world *make_plane_beam(const char *shape)
{
	return make_beam(shape,
			 "<transform name='to_world'><scale x='1' y='1.5'/><rotate x='1' y='.5' z='.2' angle='37'/>"
			 "<translate x='5.3' y='-2.1' z='3.7'/></transform>");
}

#define BALL "<point name='center' x='.25' y='-.5' z='.125'/><float name='radius' value='.5'/>"

static double emitted_radiance(const struct emitter *em, const struct emitter_point *x, vec3 w)
{
	return em->ops->radiance(em, x, w, &grey).v[0];
}

static void check_directions(const struct emitter *em, const char *name)
{
	enum { RINGS = 2000 };
	struct dice d = dice_for_test(name);
	for (size_t i = 0, n = dice_scaled_count(20000); i < n; i++) {
		double u[2] = {dice_uniform(&d), dice_uniform(&d)}, v[2] = {dice_uniform(&d), dice_uniform(&d)}, pdf;
		struct emitter_point x;
		vec3 w;
		assert_true(em->ops->sample_point(em, u, &x, &pdf));
		assert_true(em->ops->sample_direction(em, &x, v, &w, &pdf));
		assert_true(fabs(vec3_length(w) - 1) < 1e-12 && acos(fmin(vec3_dot(w, x.n), 1)) < 1.0001 * half_angle);
		assert_true(fabs(em->ops->pdf_direction(em, &x, w) / pdf - 1) < 1e-9);
		/* Power per area: L cos / pdf. The normals of a disk's triangles differ by the rounding of its rim. */
		assert_true(fabs(emitted_radiance(em, &x, w) * vec3_dot(w, x.n) / pdf / power - 1) < 1e-6);
		assert_true(emitted_radiance(em, &x, vec3_neg(w)) == 0);
	}
	struct emitter_point x;
	double pdf, sum = 0, flux = 0;
	assert_true(em->ops->sample_point(em, (double[]){0.3, 0.6}, &x, &pdf));
	struct frame f = frame_around(x.n);
	for (int i = 0; i < RINGS; i++) {
		double width = 1.5 * half_angle / RINGS, angle = (i + 0.5) * width;
		vec3 w = frame_to_world(&f, (vec3){sin(angle) * cos(1.0 * i), sin(angle) * sin(1.0 * i), cos(angle)});
		double ring = 2 * M_PI * sin(angle) * width;
		sum += em->ops->pdf_direction(em, &x, w) * ring;
		flux += emitted_radiance(em, &x, w) * cos(angle) * ring;
		assert_true(angle < 1.001 * half_angle || emitted_radiance(em, &x, w) == 0);
		assert_true(emitted_radiance(em, &x, w) <= em->brightness_bound);
	}
	print_message("%s: density %.6f, power per area %.6f\n", name, sum, flux);
	assert_true(fabs(sum - 1) < 1e-4 && fabs(flux / power - 1) < 1e-4);
}

static void test_directions_stay_within_the_cone(void **state)
{
	(void)state;
	struct world *w[] = {make_plane_beam("rectangle"), make_plane_beam("disk"), make_beam("sphere", BALL),
			     make_beam("sphere", BALL "<boolean name='flip_normals' value='true'/>")};
	static const char *const names[] = {"rectangle", "disk", "sphere", "sphere, inwards"};
	for (int i = 0; i < 4; i++) {
		check_directions(&w[i]->emitters[0], names[i]);
		world_free(w[i]);
	}
}

/* Estimates the irradiance of a surface at ref that faces the light; n: from ref towards the light. */
static struct stats_mean estimate_irradiance(const struct emitter *em, vec3 ref, vec3 n, const char *name)
{
	enum { GROUPS = 16 };
	double means[GROUPS] = {0};
	struct dice d = dice_for_test(name);
	size_t each = dice_scaled_count(2500);
	for (size_t i = 0; i < each * GROUPS; i++) {
		double u[2] = {dice_uniform(&d), dice_uniform(&d)}, pdf;
		struct emitter_point x;
		if (!emitter_sample_toward(em, ref, u, &x, &pdf))
			continue;
		assert_true(fabs(emitter_pdf_toward(em, ref, &x) / pdf - 1) < 1e-6);
		vec3 to = vec3_sub(x.p, ref);
		double l2 = vec3_dot(to, to);
		vec3 w = vec3_scale(1 / sqrt(l2), to);
		double g = fmax(vec3_dot(w, n), 0) * fmax(-vec3_dot(w, x.n), 0) / l2;
		means[i % GROUPS] += emitted_radiance(em, &x, vec3_neg(w)) * g / pdf / (double)each;
	}
	return stats_mean_test(means, GROUPS, power);
}

static void expect_irradiance(const struct emitter *em, vec3 ref, vec3 n, double expected, const char *name)
{
	struct stats_mean m = estimate_irradiance(em, ref, n, name);
	print_message("%s: %.5f +- %.5f, expected %.5f\n", name, m.mean, m.error, expected);
	if (fabs(m.mean - expected) > 8 * m.error + 1e-4 * expected)
		fail_msg("%s: %g +- %g instead of %g", name, m.mean, m.error, expected);
	assert_true(test_is_scaled() || m.error <= 0.002 * expected);
}

/* Returns the normal of a plane, from points that are far apart. */
static vec3 plane_normal(const struct emitter *em)
{
	static const double u[3][2] = {{0.1, 0.3}, {0.45, 0.9}, {0.8, 0.6}};
	struct emitter_point x[3];
	double pdf;
	for (int i = 0; i < 3; i++)
		assert_true(em->ops->sample_point(em, u[i], &x[i], &pdf));
	vec3 n = vec3_normalize(vec3_cross(vec3_sub(x[1].p, x[0].p), vec3_sub(x[2].p, x[0].p)));
	return vec3_dot(n, x[0].n) > 0 ? n : vec3_neg(n);
}

static void check_plane(const char *shape)
{
	struct world *w = make_plane_beam(shape);
	const struct emitter *em = &w->emitters[0];
	struct emitter_point x;
	double pdf;
	const double distances[] = {1e-3, 0.1, 3, 10};
	assert_true(em->ops->sample_point(em, (double[]){0.4, 0.7}, &x, &pdf));
	vec3 n = plane_normal(em);
	double side = sqrt(1 / pdf); /* side of a square of the light's area, in the rescaled world */
	for (int i = 0; i < 4; i++) {
		char name[64];
		snprintf(name, sizeof name, "%s at %g", shape, distances[i]);
		vec3 ref = vec3_madd(x.p, distances[i] * side, n);
		expect_irradiance(em, ref, vec3_neg(n), power, name);
	}
	/* Points behind the plane, and beside it. */
	struct frame f = frame_around(n);
	struct stats_mean behind = estimate_irradiance(em, vec3_madd(x.p, -side, n), n, "behind");
	struct stats_mean beside =
		estimate_irradiance(em, vec3_madd(vec3_madd(x.p, side, n), 3 * side, f.s), vec3_neg(n), "beside");
	assert_true(behind.mean == 0 && beside.mean == 0);
	/* The density integrates to one over the disc around the projection. */
	enum { RINGS = 4000 };
	double t = 0.5 * side, sum = 0;
	vec3 ref = vec3_madd(x.p, t, n);
	for (int i = 0; i < RINGS; i++) {
		double width = 1.2 * t * half_angle / RINGS, r = (i + 0.5) * width;
		struct emitter_point y = x;
		y.p = vec3_madd(x.p, r, i % 2 ? f.s : f.t);
		sum += emitter_pdf_toward(em, ref, &y) * 2 * M_PI * r * width;
	}
	assert_true(fabs(sum - 1) < 1e-4);
	world_free(w);
}

static void test_plane_has_its_irradiance(void **state)
{
	(void)state;
	check_plane("rectangle");
	check_plane("disk");
}

static void test_sphere_has_its_irradiance(void **state)
{
	(void)state;
	struct world *w = make_beam("sphere", BALL);
	const struct emitter *em = &w->emitters[0];
	const struct geom_shape *s = &w->shapes[0];
	const double gaps[] = {1e-3, 0.1, 1, 100};
	vec3 away = vec3_normalize((vec3){1, -2, 3});
	for (int i = 0; i < 4; i++) {
		char name[64];
		snprintf(name, sizeof name, "sphere at %g radii", gaps[i]);
		vec3 ref = vec3_madd(s->center, s->radius * (1 + gaps[i]), away);
		expect_irradiance(em, ref, vec3_neg(away), power / ((1 + gaps[i]) * (1 + gaps[i])), name);
	}
	world_free(w);
}

/* On a surface that is neither a plane nor a sphere, the shining part is not searched for. */
static void test_curved_surfaces_are_not_searched(void **state)
{
	(void)state;
	static const char scene[] =
		"<scene version='3.0.0'>" EYE "<shape type='obj'><string name='filename' value='bent.obj'/>" BEAM
		"</shape></scene>";
	static const char bent[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 .01\nf 1 2 3\nf 2 4 3\n";
	const struct memory_file files[] = {
		{"bent.xml", scene, sizeof scene - 1}, {"bent.obj", bent, sizeof bent - 1}, {NULL, NULL, 0}};
	struct world *w = world_from_files(8, 8, files);
	const struct emitter *em = &w->emitters[0];
	struct emitter_point x;
	double pdf;
	for (int i = 0; i < 100; i++) {
		assert_true(emitter_sample_toward(em, (vec3){0, 0, 1}, (double[]){i / 100.0, 0.5}, &x, &pdf));
		assert_true(pdf == em->ops->pdf_point(em, &x) && pdf == emitter_pdf_toward(em, (vec3){0, 0, 1}, &x));
	}
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_directions_stay_within_the_cone),
		cmocka_unit_test(test_plane_has_its_irradiance),
		cmocka_unit_test(test_sphere_has_its_irradiance),
		cmocka_unit_test(test_curved_surfaces_are_not_searched),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
