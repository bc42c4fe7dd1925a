/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A moving world at time t, against a static world placed where the moving one is at that time, by transforms that
 * this test computes itself: surfaces, their derivatives, hits of rays and segments, the camera, and lights with
 * their power.
 */
#include "tests/support/dice.h"
#include "tests/support/memory_assets.h"
#include "tests/support/worlds.h"
#include "worker/render/world/build.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define TO(inner) "<transform name='to_world'>" inner "</transform>"
#define OPEN(a, b) "<float name='shutter_open' value='" a "'/><float name='shutter_close' value='" b "'/>"
#define VIEW(shutter)                                                                                  \
	"<sensor type='perspective'><float name='fov' value='40'/>" shutter TO(                        \
		"<lookat origin='0,0,8' target='0,0,0' up='0,1,0'/>") "<film type='hdrfilm'><rfilter " \
								      "type='box'/></film></sensor>"
#define SKY "<emitter type='constant'/>"
#define FLOOR "<shape type='rectangle'>" TO("<scale value='5'/><translate z='-3'/>") "</shape>"
#define AREA "<emitter type='area'><float name='radiance' value='2'/></emitter>"
#define BEAM "<emitter type='directionalarea'><float name='radiance' value='2'/></emitter>"

static const char ball_obj[] = "v 1 0 0\nv -1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nv 0 0 -1\n"
			       "vn 1 0 0\nvn -1 0 0\nvn 0 1 0\nvn 0 -1 0\nvn 0 0 1\nvn 0 0 -1\n"
			       "f 1//1 3//3 5//5\nf 3//3 2//2 5//5\nf 2//2 4//4 5//5\nf 4//4 1//1 5//5\n"
			       "f 3//3 1//1 6//6\nf 2//2 3//3 6//6\nf 4//4 2//2 6//6\nf 1//1 4//4 6//6\n";

/* The motion of a shape: its scale, rotation and position change at constant rates. */
struct shape_motion {
	const char *axis;
	double angle[2]; /* degrees */
	double scale[2], position[2][3];
};
static const struct shape_motion motions[] = {
	{"x='0' y='1' z='0'", {10, 150}, {0.5, 0.8}, {{-2, 0, 0}, {-1, 1, 0.5}}},
	{"x='1' y='1' z='0.5'", {0, 90}, {0.6, 0.6}, {{1, 1, 0}, {1, 1, 0}}},
	{"x='0.3' y='0' z='1'", {-40, 60}, {0.7, 0.4}, {{2, -1, 1}, {0, -1.5, -1}}},
	{"x='0' y='0' z='1'", {0, 0}, {0.3, 0.3}, {{0, 0, 2}, {0, 2, 2}}},
};
enum { MOTION_COUNT = sizeof motions / sizeof *motions };

static double value_at_time(const double v[2], double t)
{
	return (1 - t) * v[0] + t * v[1];
}

static size_t append_steps(char *out, size_t size, const struct shape_motion *c, double t)
{
	double at[3];
	for (int i = 0; i < 3; i++)
		at[i] = (1 - t) * c->position[0][i] + t * c->position[1][i];
	return (size_t)snprintf(
		out, size, "<scale value='%.17g'/><rotate %s angle='%.17g'/><translate x='%.17g' y='%.17g' z='%.17g'/>",
		value_at_time(c->scale, t), c->axis, value_at_time(c->angle, t), at[0], at[1], at[2]);
}

/* Writes the transform of shape k at time t, or its animation if t is negative; returns the length. */
static size_t append_transform(char *out, size_t size, int k, double t)
{
	size_t at = (size_t)snprintf(out, size, "%s", t < 0 ? "<animation name='to_world'>" : "");
	for (int i = 0; i < (t < 0 ? 2 : 1); i++) {
		at += (size_t)snprintf(out + at, size - at,
				       t < 0 ? "<transform time='%d'>" : "<transform name='to_world'>", i);
		at += append_steps(out + at, size - at, &motions[k], t < 0 ? i : t);
		at += (size_t)snprintf(out + at, size - at, "</transform>");
	}
	return at + (size_t)snprintf(out + at, size - at, "%s", t < 0 ? "</animation>" : "");
}

/* A mesh, a card, a sphere, and a group with a mesh and a sphere; a floor that does not move. */
static struct world *world_at(double t)
{
	static char xml[1 << 14];
	static const char *const begin[] = {
		"<shape type='obj'><string name='filename' value='m.obj'/>", "<shape type='rectangle'>",
		"<shape type='sphere'><point name='center' value='0.1,0.2,-0.1'/><float name='radius' value='0.9'/>",
		"<shape type='shapegroup' id='g'><shape type='obj'><string name='filename' value='m.obj'/></shape>"
		"<shape type='sphere'>" TO(
			"<translate x='1.5'/>") "</shape></shape><shape type='instance'><ref id='g'/>"};
	size_t at = (size_t)snprintf(xml, sizeof xml, "<scene version='3.0.0'>" VIEW(OPEN("0", "1")) SKY FLOOR);
	for (int k = 0; k < MOTION_COUNT; k++) {
		at += (size_t)snprintf(xml + at, sizeof xml - at, "%s", begin[k]);
		at += append_transform(xml + at, sizeof xml - at, k, t);
		at += (size_t)snprintf(xml + at, sizeof xml - at, "</shape>");
	}
	at += (size_t)snprintf(xml + at, sizeof xml - at, "</scene>");
	assert_true(at + 1 < sizeof xml);
	const struct memory_file files[] = {
		{"s.xml", xml, at}, {"m.obj", ball_obj, sizeof ball_obj - 1}, {NULL, NULL, 0}};
	return world_from_files(32, 32, files);
}

static vec3 in_scene(const struct world *w, vec3 p)
{
	return vec3_madd(w->center, 1 / w->scale, p);
}

static vec3 in_world(const struct world *w, vec3 p)
{
	return vec3_scale(w->scale, vec3_sub(p, w->center));
}

static void assert_near(vec3 a, vec3 b, double off)
{
	if (!(vec3_length(vec3_sub(a, b)) <= off))
		fail_msg("(%g, %g, %g) is not (%g, %g, %g)", a.x, a.y, a.z, b.x, b.y, b.z);
}

static struct surface_point sample_shape_point(const struct world *w, uint32_t shape, double t, const double u[2])
{
	const struct geom_shape *s = &w->shapes[shape];
	struct surface_point x;
	struct prim_ref prim = {shape, 0, t};
	if (s->is_sphere) {
		double z = 2 * u[0] - 1, r = sqrt(1 - z * z);
		const struct geom_shape *still = s;
		struct placement now;
		vec3 d = {r * cos(6 * u[1]), r * sin(6 * u[1]), z}; /* in the sphere's own frame */
		vec3 a = still->sphere_axes.s, b = still->sphere_axes.t, c = still->sphere_axes.n;
		if (s->placement) {
			placement_compute_at(s->placement, t, &now);
			a = vec3_normalize(placement_vector(&now, a));
			b = vec3_normalize(placement_vector(&now, b));
			c = vec3_normalize(placement_vector(&now, c));
		}
		surface_on_sphere(s, prim, vec3_madd(vec3_madd(vec3_scale(d.x, a), d.y, b), d.z, c), &x);
	} else {
		prim.prim = (uint32_t)(u[0] * s->triangle_count);
		surface_on_triangle(s, prim, u[1] * 0.5, (1 - u[1]) * 0.7, &x);
	}
	return x;
}

/* Tolerance in scene units: vertices are rounded to float in another frame. */
#define POSITION_TOLERANCE 1e-5

static void check_point(const struct world *moving, const struct world *still, uint32_t shape, double t, struct dice *d)
{
	const double u[2] = {dice_uniform(d), dice_uniform(d)};
	struct surface_point x = sample_shape_point(moving, shape, t, u), y = sample_shape_point(still, shape, 0, u), z;
	struct surface_derivatives a, b;
	assert_near(in_scene(moving, x.p), in_scene(still, y.p), POSITION_TOLERANCE);
	assert_near(x.ng, y.ng, POSITION_TOLERANCE);
	assert_near(x.sh.n, y.sh.n, POSITION_TOLERANCE);
	assert_true(x.shape == &moving->shapes[shape] && x.prim.time == t);
	assert_true(fabs(x.u - y.u) <= POSITION_TOLERANCE && fabs(x.v - y.v) <= POSITION_TOLERANCE);
	surface_compute_derivatives(&moving->shapes[shape], &x, &a);
	surface_compute_derivatives(&still->shapes[shape], &y, &b);
	for (int k = 0; k < 2; k++)
		assert_near(vec3_scale(moving->scale, a.dn[k]), vec3_scale(still->scale, b.dn[k]),
			    10 * POSITION_TOLERANCE);
	assert_true(surface_nearest(&moving->shapes[shape], x.prim, x.p, &z));
	assert_near(x.p, z.p, 1e-12);
	const vec3 o = vec3_madd(x.p, 1, x.ng);
	if (surface_reproject(&moving->shapes[shape], x.prim, prim_none_at(t), o, vec3_neg(x.ng), 1, &z))
		assert_near(x.p, z.p, 1e-9);
}

static void check_ray(const struct world *moving, const struct world *still, double t, struct dice *d)
{
	vec3 o = vec3_scale(dice_between(d, 0, 4), dice_direction(d)), w = dice_direction(d),
	     far = vec3_scale(3, dice_direction(d));
	struct ray_end from = {in_world(moving, o), {0, 0, 0}, prim_none_at(t)}, to = from;
	struct ray_end from2 = {in_world(still, o), {0, 0, 0}, PRIM_NONE}, to2 = from2;
	struct ray_hit hit, hit2;
	to.p = in_world(moving, far);
	to2.p = in_world(still, far);
	bool met = accel_closest(moving->accel, &from, w, 0, INFINITY, &hit),
	     met2 = accel_closest(still->accel, &from2, w, 0, INFINITY, &hit2);
	assert_int_equal(met, met2);
	assert_int_equal(accel_occluded(moving->accel, &from, &to), accel_occluded(still->accel, &from2, &to2));
	assert_int_equal(accel_occluded_to_infinity(moving->accel, &from, w), met2);
	if (!met)
		return;
	struct surface_point x, y;
	assert_int_equal(hit.prim.shape, hit2.prim.shape);
	assert_true(hit.prim.time == t);
	surface_from_hit(&moving->shapes[hit.prim.shape], from.p, w, &hit, &x);
	surface_from_hit(&still->shapes[hit2.prim.shape], from2.p, w, &hit2, &y);
	assert_near(in_scene(moving, x.p), in_scene(still, y.p), 100 * POSITION_TOLERANCE);
	assert_near(x.sh.n, y.sh.n, 100 * POSITION_TOLERANCE);
	/* The next ray starts at the hit and must not meet the same point again. */
	from = (struct ray_end){x.p, x.ng, x.prim};
	vec3 away = vec3_scale(vec3_dot(x.ng, w) < 0 ? 1 : -1, x.ng);
	if (accel_closest(moving->accel, &from, away, 0, INFINITY, &hit))
		assert_true(hit.t > 1e-9);
}

static void test_moving_world_equals_still_ones(void **state)
{
	(void)state;
	struct dice d = dice_for_test("a world at a time");
	struct world *moving = world_at(-1);
	assert_true(moving->effects.motion);
	for (int i = 0; i <= 10; i++) {
		double t = i == 10 ? 1 - 0x1p-53 : i == 0 ? 0 : dice_uniform(&d);
		struct world *still = world_at(t);
		assert_false(still->effects.motion);
		assert_int_equal(moving->shape_count, still->shape_count);
		for (uint32_t s = 0; s < moving->shape_count; s++)
			for (size_t n = dice_scaled_count(100); n > 0; n--)
				check_point(moving, still, s, t, &d);
		for (size_t n = dice_scaled_count(5000); n > 0; n--)
			check_ray(moving, still, t, &d);
		world_free(still);
	}
	world_free(moving);
}

/* The camera turns, moves, and mirrors the image. */
static struct world *camera_world(double t)
{
#define STEPS "<scale x='-2' y='2' z='2'/><rotate y='1' angle='%.17g'/><translate x='%.17g' y='0.5' z='%.17g'/>"
	char place[1024], first[256], last[256];
	snprintf(first, sizeof first, STEPS, 160.0, -1.0, 8.0);
	snprintf(last, sizeof last, STEPS, 200.0, 1.0, 6.0);
	if (t < 0)
		snprintf(
			place, sizeof place,
			"<animation name='to_world'><transform time='0'>%s</transform><transform time='1'>%s</transform>"
			"</animation>",
			first, last);
	else {
		snprintf(first, sizeof first, STEPS, 160 + 40 * t, -1 + 2 * t, 8 - 2 * t);
		snprintf(place, sizeof place, TO("%s"), first);
	}
	return world_from_text(
		32, 32,
		"<sensor type='thinlens'><float name='fov' value='40'/><float name='aperture_radius' value='0.2'/>"
		"<float name='focus_distance' value='7'/>" OPEN("0", "1") "%s</sensor>" SKY "<shape type='cube'/>",
		place);
}

static void test_moving_camera_equals_still_ones(void **state)
{
	(void)state;
	struct dice d = dice_for_test("a camera at a time");
	struct world *moving = camera_world(-1);
	assert_true(moving->effects.motion && moving->camera.motion);
	for (int i = 0; i < 20; i++) {
		double t = dice_uniform(&d), u[2] = {dice_uniform(&d), dice_uniform(&d)},
		       film[2] = {32 * u[1], 32 * u[0]}, x, y;
		struct world *still = camera_world(t);
		struct camera room;
		const struct camera *a = camera_at(&moving->camera, t, &room), *b = &still->camera;
		assert_near(in_scene(moving, a->position), in_scene(still, b->position), 1e-12);
		assert_near(a->axes.s, b->axes.s, 1e-12);
		assert_near(a->axes.t, b->axes.t, 1e-12);
		assert_near(a->axes.n, b->axes.n, 1e-12);
		vec3 p = camera_sample_point(a, u);
		assert_near(in_scene(moving, p), in_scene(still, camera_sample_point(b, u)), 1e-12);
		vec3 w = camera_direction(a, p, film[0], film[1]);
		assert_near(w, camera_direction(b, camera_sample_point(b, u), film[0], film[1]), 1e-12);
		assert_true(camera_project(a, p, w, 1, &x, &y));
		assert_true(fabs(x - film[0]) < 1e-9 && fabs(y - film[1]) < 1e-9);
		world_free(still);
	}
	world_free(moving);
}

/* ---- lights ---- */

/* The shapes emit light, and there are lights without a surface. */
static struct world *lights_at(double t)
{
	static char xml[1 << 14];
	static const char *const begin[] = {
		"<shape type='obj'><string name='filename' value='m.obj'/>" AREA,
		"<shape type='disk'>" BEAM,
		"<shape type='sphere'><point name='center' value='0.1,0.2,-0.1'/><float name='radius' value='0.9'/>" AREA,
		"<shape type='shapegroup' id='g'><shape type='cube'>" AREA "</shape><shape type='sphere'>" BEAM TO(
			"<translate x='1.5'/>") "</shape></shape><shape type='instance'><ref id='g'/>",
		"<emitter type='directional'>",
		"<emitter type='projector'>",
		"<emitter type='point'>",
		"<emitter type='spot'>",
		"<emitter type='collimated'>"};
	enum { ITEMS = sizeof begin / sizeof *begin };
	size_t at = (size_t)snprintf(xml, sizeof xml, "<scene version='3.0.0'>" VIEW(OPEN("0", "1")) FLOOR);
	for (int k = 0; k < ITEMS; k++) {
		at += (size_t)snprintf(xml + at, sizeof xml - at, "%s", begin[k]);
		at += append_transform(xml + at, sizeof xml - at, k % MOTION_COUNT, t);
		at += (size_t)snprintf(xml + at, sizeof xml - at, k < 4 ? "</shape>" : "</emitter>");
	}
	at += (size_t)snprintf(xml + at, sizeof xml - at, "</scene>");
	assert_true(at + 1 < sizeof xml);
	const struct memory_file files[] = {
		{"s.xml", xml, at}, {"m.obj", ball_obj, sizeof ball_obj - 1}, {NULL, NULL, 0}};
	return world_from_files(32, 32, files);
}

static void expect_close(double a, double b, double tolerance)
{
	if (!(fabs(a - b) <= tolerance * fabs(b)))
		fail_msg("%.17g is not %.17g", a, b);
}

/* Converts to scene units a density per area of the rescaled world, or an intensity, which is per square of the
 * world's unit of length. */
static double scene_density(const struct world *w, const struct emitter *em, double value)
{
	return em->is_delta || em->is_infinite ? value : value * w->scale * w->scale;
}

static void assert_near_point(const struct world *moving, const struct world *still, const struct emitter_point *x,
			      const struct emitter_point *y, double off)
{
	assert_int_equal(x->is_infinite, y->is_infinite);
	if (x->is_infinite)
		assert_near(x->p, y->p, off);
	else
		assert_near(in_scene(moving, x->p), in_scene(still, y->p), off);
	assert_near(x->n, y->n, off);
}

static void check_light(const struct world *moving, const struct world *still, uint32_t id, double t, struct dice *d)
{
	static const struct wavelengths grey = {.is_grey = true};
	struct emitter_storage room;
	const struct emitter *a = emitter_at(&moving->emitters[id], t, &room), *b = &still->emitters[id];
	const double u[2] = {dice_uniform(d), dice_uniform(d)}, v[2] = {dice_uniform(d), dice_uniform(d)};
	struct emitter_point x, y;
	double p, q, back[2];
	vec3 from, to;
	assert_true(moving->emitters[id].motion && !b->motion);
	assert_true(a->ops->sample_point(a, u, &x, &p));
	assert_true(b->ops->sample_point(b, u, &y, &q));
	assert_near_point(moving, still, &x, &y,
			  100 * POSITION_TOLERANCE); /* the point lies in the cell of a narrow triangle */
	expect_close(scene_density(moving, a, p), scene_density(still, b, q), POSITION_TOLERANCE);
	expect_close(a->ops->pdf_point(a, &x), p, 1e-9);
	if (moving->emitter_shapes[id] != UINT32_MAX) {
		const struct prim_ref prim = {moving->emitter_shapes[id], x.texture_point.prim, t};
		struct surface_point on;
		assert_true(surface_nearest(&moving->shapes[prim.shape], prim, x.p, &on));
		assert_near(on.p, x.p, 1e-12);
		assert_near(on.ng, x.n, 1e-9);
		assert_true(fabs(on.u - x.texture_point.u) < 1e-9 && fabs(on.v - x.texture_point.v) < 1e-9);
		a->ops->point_inverse(a, &x, back);
		assert_true(fabs(back[0] - u[0]) < 1e-9 && fabs(back[1] - u[1]) < 1e-9);
	}
	if (!a->is_infinite) {
		assert_true(a->ops->sample_direction(a, &x, v, &from, &p));
		assert_true(b->ops->sample_direction(b, &y, v, &to, &q));
		assert_near(from, to, 1e-4);
		expect_close(p, q, 2e-2);
		double l = a->ops->radiance(a, &x, from, &grey).v[0], m = b->ops->radiance(b, &y, to, &grey).v[0];
		expect_close(a->is_delta ? l / (moving->scale * moving->scale) : l,
			     a->is_delta ? m / (still->scale * still->scale) : m, 2e-2);
		expect_close(a->ops->pdf_direction(a, &x, from), p, 1e-9);
	}
	vec3 ref = vec3_scale(dice_between(d, 0, 4), dice_direction(d));
	bool met = emitter_sample_toward(a, in_world(moving, ref), u, &x, &p),
	     met2 = emitter_sample_toward(b, in_world(still, ref), u, &y, &q);
	if (!met || !met2)
		return;
	assert_near_point(moving, still, &x, &y,
			  100 * POSITION_TOLERANCE); /* the direction lies at the edge of a cone */
	expect_close(scene_density(moving, a, p), scene_density(still, b, q), 1e-3);
	expect_close(emitter_pdf_toward(a, in_world(moving, ref), &x), p, 1e-6);
}

static void test_moving_lights_equal_still_ones(void **state)
{
	(void)state;
	struct dice d = dice_for_test("lights at a time");
	struct world *moving = lights_at(-1);
	assert_true(moving->effects.motion && moving->emitter_count == 10);
	for (int i = 0; i <= 10; i++) {
		double t = i == 10 ? 1 - 0x1p-53 : i == 0 ? 0 : dice_uniform(&d);
		struct world *still = lights_at(t);
		assert_int_equal(moving->emitter_count, still->emitter_count);
		for (uint32_t e = 0; e < moving->emitter_count; e++)
			for (size_t n = dice_scaled_count(300); n > 0; n--)
				check_light(moving, still, e, t, &d);
		world_free(still);
	}
	world_free(moving);
}

static double triangle_area(const struct world *w, uint32_t triangle, double t)
{
	vec3 p[3];
	for (int k = 0; k < 3; k++) {
		struct surface_point x;
		surface_on_triangle(&w->shapes[0], (struct prim_ref){0, triangle, t}, k == 1, k == 2, &x);
		p[k] = x.p;
	}
	return 0.5 * vec3_length(vec3_cross(vec3_sub(p[1], p[0]), vec3_sub(p[2], p[0])));
}

/* A cube of which one dimension grows and another shrinks. The number of points on each triangle must match the
 * stated density at every time, by Pearson's chi^2 with 11 degrees of freedom (limit 50: level 6e-7), and points must
 * be uniform within each triangle. */
static void test_points_of_stretched_lights_follow_their_density(void **state)
{
	(void)state;
	enum { TRIANGLES = 12 };
	struct dice d = dice_for_test("a stretched lamp");
	struct world *w = world_from_text(
		32, 32,
		VIEW(OPEN("0",
			  "1")) "<shape type='cube'><animation name='to_world'><transform time='0'><scale x='0.2'/>"
				"</transform><transform time='1'><scale y='0.1' z='3'/><rotate x='1' angle='50'/>"
				"</transform></animation>" AREA "</shape>");
	const double times[] = {0, 0.3, 0.999};
	for (int k = 0; k < 3; k++) {
		struct emitter_storage room;
		const struct emitter *em = emitter_at(&w->emitters[0], times[k], &room);
		double share[TRIANGLES], sum = 0, chi2 = 0, middle[2] = {0, 0};
		size_t found[TRIANGLES] = {0}, n = dice_scaled_count(100000);
		for (uint32_t i = 0; i < TRIANGLES; i++) {
			const struct emitter_point x = {.texture_point.prim = i};
			share[i] = em->ops->pdf_point(em, &x) * triangle_area(w, i, times[k]);
			sum += share[i];
		}
		expect_close(sum, 1, 1e-12);
		for (size_t i = 0; i < n; i++) {
			const double u[2] = {dice_uniform(&d), dice_uniform(&d)};
			struct emitter_point x;
			double pdf;
			assert_true(em->ops->sample_point(em, u, &x, &pdf));
			found[x.texture_point.prim]++;
			middle[0] += x.texture_point.b1 / (double)n;
			middle[1] += x.texture_point.b2 / (double)n;
		}
		for (uint32_t i = 0; i < TRIANGLES; i++)
			chi2 += pow((double)found[i] - share[i] * (double)n, 2) / (share[i] * (double)n);
		assert_true(chi2 < 50);
		/* The mean of a barycentric coordinate is 1/3, within six standard deviations; its variance is 1/18. */
		for (int i = 0; i < 2; i++)
			assert_true(fabs(middle[i] - 1.0 / 3) < 6 * sqrt(1.0 / 18 / (double)n));
	}
	world_free(w);
}

/* Emitters are chosen by their mean power: for a light that grows from scale 1 to 2, that of the area at scale 1
 * times (1 + 2 + 4) / 3. */
static void check_power(const char *shape, double area)
{
	struct world *w = world_from_text(
		32, 32,
		VIEW(OPEN("0",
			  "1")) "<shape type='%s'><animation name='to_world'><transform time='0'/><transform time='1'>"
				"<scale value='2'/></transform></animation>" AREA "</shape>",
		shape);
	const struct emitter *em = &w->emitters[0];
	bool said = false;
	for (size_t i = 0; i < w->effects.effect_line_count; i++)
		said |= strstr(w->effects.effect_lines[i].reason, "moves while the shutter is open") != NULL;
	assert_true(said); /* exactly one note, not one for the shape and one for the emitter */
	expect_close(em->power / (M_PI * em->brightness_bound * w->scale * w->scale), area * 7 / 3, 1e-3);
	world_free(w);
}

static void test_growing_lights_have_their_mean_power(void **state)
{
	(void)state;
	check_power("rectangle", 4);
	check_power("sphere", 4 * M_PI);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_moving_world_equals_still_ones),
		cmocka_unit_test(test_moving_lights_equal_still_ones),
		cmocka_unit_test(test_points_of_stretched_lights_follow_their_density),
		cmocka_unit_test(test_growing_lights_have_their_mean_power),
		cmocka_unit_test(test_moving_camera_equals_still_ones),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
