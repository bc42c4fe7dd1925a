/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Rays in a scene of mixed scales: a floor of two triangles, and in its middle a half-sunk bumpy ball and a sphere,
 * both 2^-12 to 2^-36 as large. From near and from far, with the far end first or last, every ray must meet what a
 * search in double meets, at the same point, except for one in a thousand (3 % at the smallest size), which passes an
 * edge of the small ball by less than float precision.
 */
#include "tests/support/bodies.h"
#include "worker/render/geom/accel.h"

#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

enum { SHAPES = 3 };

struct scene {
	struct geom_shape shape[SHAPES];
	struct accel *accel;
	double small_size;
};

static struct scene make_scene(double small)
{
	struct scene s = {.small_size = small};
	body_make_plane(&s.shape[0], 1, 0.5, 0.25);
	body_make_ball(&s.shape[1], 6, small, 0.15);
	s.shape[2] = (struct geom_shape){.is_sphere = true,
					 .center = {2 * small, 0.6 * small, 2 * small},
					 .radius = 0.7 * small,
					 .normal_sign = 1};
	s.accel = body_build_accel(s.shape, SHAPES);
	return s;
}

static void scene_free(struct scene *s)
{
	accel_free(s->accel);
	body_fini(&s->shape[0]);
	body_fini(&s->shape[1]);
}

/* Returns the nearest hit of a sphere from outside; d is a unit vector. */
static double sphere_nearest(const struct geom_shape *s, vec3 o, vec3 d)
{
	vec3 oc = vec3_sub(s->center, o);
	double along = vec3_dot(oc, d), pass = vec3_length(vec3_madd(oc, -along, d));
	if (pass > s->radius || along < 0)
		return INFINITY;
	return along - sqrt((s->radius - pass) * (s->radius + pass));
}

static double nearest_hit(const struct scene *s, vec3 o, vec3 d, uint32_t *shape)
{
	double best = INFINITY;
	for (uint32_t i = 0; i < SHAPES; i++) {
		uint32_t prim;
		double t = s->shape[i].is_sphere ? sphere_nearest(&s->shape[i], o, d)
						 : body_hit_distance(&s->shape[i], o, d, 0, &prim);
		if (t < best) {
			best = t;
			*shape = i;
		}
	}
	return best;
}

/* Returns a point over the floor, within a few sizes of the small shapes and outside the sphere. */
static vec3 near_point(const struct scene *s, struct dice *d)
{
	for (;;) {
		vec3 p = vec3_scale(3 * s->small_size,
				    (vec3){dice_between(d, -1, 1), dice_between(d, -1, 1), dice_between(d, -1, 1)});
		double height = p.z - 0.5 * p.x - 0.25 * p.y;
		if (height > 0 && vec3_length(p) > 1.2 * s->small_size &&
		    vec3_length(vec3_sub(p, s->shape[2].center)) > s->shape[2].radius)
			return p;
	}
}

static vec3 far_point(struct dice *d)
{
	vec3 p = vec3_scale(dice_between(d, 0.01, 0.9), dice_direction(d));
	return p.z - 0.5 * p.x - 0.25 * p.y > 0 ? p : vec3_neg(p);
}

static size_t check_closest(const struct scene *s, struct dice *d, bool far, size_t n, size_t met[SHAPES])
{
	size_t wrong = 0;
	for (size_t i = 0; i < n; i++) {
		vec3 aim = near_point(s, d);
		const struct ray_end from = {.p = far ? far_point(d) : near_point(s, d), .prim = PRIM_NONE};
		vec3 w = vec3_normalize(vec3_sub(aim, from.p));
		uint32_t shape = 0;
		double t = nearest_hit(s, from.p, w, &shape);
		struct ray_hit hit;
		struct surface_point x;
		bool is_met = accel_closest(s->accel, &from, w, 0, INFINITY, &hit);
		if (is_met != (bool)isfinite(t) || (is_met && hit.prim.shape != shape)) {
			wrong++;
			continue;
		}
		if (!is_met)
			continue;
		met[shape]++;
		surface_from_hit(&s->shape[shape], from.p, w, &hit, &x);
		/* The floor's vertices and the directions of far rays are doubles of about 1, whose rounding adds to
		 * the error. */
		double deviation = vec3_length(vec3_sub(x.p, vec3_madd(from.p, t, w)));
		wrong += !(deviation <= 1e-4 * s->small_size + 0x1p-48);
	}
	return wrong;
}

static size_t check_segments(const struct scene *s, struct dice *d, size_t n, size_t *blocked)
{
	size_t wrong = 0;
	for (size_t i = 0; i < n; i++) {
		struct ray_end a = {.p = near_point(s, d), .prim = PRIM_NONE},
			       b = {.p = i % 2 ? near_point(s, d) : far_point(d), .prim = PRIM_NONE};
		vec3 w = vec3_sub(b.p, a.p);
		double length = vec3_length(w);
		uint32_t shape;
		bool is_blocked = nearest_hit(s, a.p, vec3_scale(1 / length, w), &shape) < length;
		*blocked += is_blocked;
		wrong += accel_occluded(s->accel, &a, &b) != is_blocked ||
			 accel_occluded(s->accel, &b, &a) != is_blocked;
	}
	return wrong;
}

/* Rays that leave the floor beside the small shapes: upwards, along the floor, and towards the ball. */
static size_t check_from_the_floor(const struct scene *s, struct dice *d, size_t n)
{
	size_t wrong = 0;
	for (size_t i = 0; i < n; i++) {
		vec3 over = near_point(s, d), down = {0, 0, -1};
		struct ray_end from = {.p = over, .prim = PRIM_NONE};
		struct ray_hit hit;
		struct surface_point x;
		if (!accel_closest(s->accel, &from, down, 0, INFINITY, &hit) || hit.prim.shape != 0)
			continue;
		surface_from_hit(&s->shape[0], over, down, &hit, &x);
		from = body_ray_end(&x);
		vec3 w = dice_direction(d);
		uint32_t shape = 0;
		double t = INFINITY;
		for (uint32_t k = 1; k < SHAPES; k++) {
			uint32_t prim;
			double at = k == 2 ? sphere_nearest(&s->shape[k], x.p, w)
					   : body_hit_distance(&s->shape[k], x.p, w, 0, &prim);
			if (at < t) {
				t = at;
				shape = k;
			}
		}
		bool met = accel_closest(s->accel, &from, w, 0, INFINITY, &hit);
		wrong += met != (bool)isfinite(t) || (met && hit.prim.shape != shape);
	}
	return wrong;
}

static void rays_agree_with_a_search_at_mixed_scales(void **state)
{
	(void)state;
	/* At the last size, 1.5e-11, the rounding of the floor's own doubles amounts to 1e-4 of the size. */
	static const struct {
		double size;
		size_t wrong; /* allowed per million rays */
	} sizes[] = {{0x1p-12, 1000}, {0x1p-20, 1000}, {0x1p-30, 1000}, {0x1p-36, 30000}};
	size_t n = dice_scaled_count(20000);
	for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
		struct dice d = dice_for_test("mixed scales");
		struct scene s = make_scene(sizes[i].size);
		size_t met[SHAPES] = {0}, blocked = 0, close = check_closest(&s, &d, false, n, met),
		       far = check_closest(&s, &d, true, n, met);
		size_t segments = check_segments(&s, &d, n, &blocked), floor = check_from_the_floor(&s, &d, n);
		print_message(
			"%.0e: of %zu each, %zu from near, %zu from far, %zu segments, %zu from the floor differ; met "
			"%zu %zu %zu, blocked %zu\n",
			sizes[i].size, n, close, far, segments, floor, met[0], met[1], met[2], blocked);
		double expected = (double)n * (double)sizes[i].wrong * 1e-6;
		size_t max_wrong = (size_t)(expected + 4 * sqrt(expected) + 1); /* 4 sigma, also for small samples */
		assert_true(close <= max_wrong && far <= max_wrong && segments <= max_wrong && floor <= max_wrong);
		for (int k = 0; k < SHAPES; k++)
			assert_true(met[k] > n / 50);
		assert_true(blocked > n / 50 && blocked < n);
		scene_free(&s);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(rays_agree_with_a_search_at_mixed_scales)};
	return cmocka_run_group_tests_name("mixed scales", tests, NULL, NULL);
}
