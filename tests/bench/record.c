/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/bench/record.h"

bool __real_accel_closest(const struct accel *a, const struct ray_end *from, vec3 d, double t_min, double t_max,
			  struct ray_hit *hit);
bool __real_accel_occluded(const struct accel *a, const struct ray_end *from, const struct ray_end *to);
bool __real_accel_occluded_to_infinity(const struct accel *a, const struct ray_end *from, vec3 d);
bool __wrap_accel_closest(const struct accel *a, const struct ray_end *from, vec3 d, double t_min, double t_max,
			  struct ray_hit *hit);
bool __wrap_accel_occluded(const struct accel *a, const struct ray_end *from, const struct ray_end *to);
bool __wrap_accel_occluded_to_infinity(const struct accel *a, const struct ray_end *from, vec3 d);

static struct recorded_ray *recorded_rays;
static size_t ray_capacity, ray_count;

void record_start(struct recorded_ray *rays, size_t capacity)
{
	recorded_rays = rays;
	ray_capacity = capacity;
	ray_count = 0;
}

size_t record_stop(void)
{
	recorded_rays = NULL;
	return ray_count;
}

static void record_ray(struct recorded_ray r)
{
	if (ray_count < ray_capacity)
		recorded_rays[ray_count++] = r;
}

bool __wrap_accel_closest(const struct accel *a, const struct ray_end *from, vec3 d, double t_min, double t_max,
			  struct ray_hit *hit)
{
	if (recorded_rays)
		record_ray((struct recorded_ray){
			.kind = RAY_CLOSEST, .from = *from, .d = d, .t_min = t_min, .t_max = t_max});
	return __real_accel_closest(a, from, d, t_min, t_max, hit);
}

bool __wrap_accel_occluded(const struct accel *a, const struct ray_end *from, const struct ray_end *to)
{
	if (recorded_rays)
		record_ray((struct recorded_ray){.kind = RAY_SEGMENT, .from = *from, .to = *to});
	return __real_accel_occluded(a, from, to);
}

bool __wrap_accel_occluded_to_infinity(const struct accel *a, const struct ray_end *from, vec3 d)
{
	if (recorded_rays)
		record_ray((struct recorded_ray){.kind = RAY_INFINITE, .from = *from, .d = d});
	return __real_accel_occluded_to_infinity(a, from, d);
}

struct recorded_walks record_walks;
static bool is_walking;

bool __real_full_path_visible(struct path_context *c, const struct full_path *x, unsigned e);
bool __wrap_full_path_visible(struct path_context *c, const struct full_path *x, unsigned e);

bool __wrap_full_path_visible(struct path_context *c, const struct full_path *x, unsigned e)
{
	bool visible = __real_full_path_visible(c, x, e);
	record_walks.occluded += is_walking && !visible;
	return visible;
}

enum walk_result __real_halfvec_walk(struct path_context *c, struct full_path *y, unsigned b, unsigned c_end,
				     const struct walk_target *target, bool visible, const struct walk_limits *limits,
				     unsigned stale, struct walk_scratch *s);
enum walk_result __wrap_halfvec_walk(struct path_context *c, struct full_path *y, unsigned b, unsigned c_end,
				     const struct walk_target *target, bool visible, const struct walk_limits *limits,
				     unsigned stale, struct walk_scratch *s);

enum walk_result __wrap_halfvec_walk(struct path_context *c, struct full_path *y, unsigned b, unsigned c_end,
				     const struct walk_target *target, bool visible, const struct walk_limits *limits,
				     unsigned stale, struct walk_scratch *s)
{
	is_walking = true;
	enum walk_result end = __real_halfvec_walk(c, y, b, c_end, target, visible, limits, stale, s);
	is_walking = false;
	/* Only a walk back knows that the path which it must reproduce is visible. */
	(visible ? record_walks.backward : record_walks.forward)[end]++;
	return end;
}
