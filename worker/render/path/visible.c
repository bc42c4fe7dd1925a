/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/path/visible.h"

static struct ray_end ray_end_of(const struct path_vertex *v)
{
	return (struct ray_end){v->x.p, v->kind == VERTEX_CAMERA ? (vec3){0, 0, 0} : v->x.ng, v->x.prim};
}

/* Whether the camera sees b. Surfaces in front of the near plane hide nothing: an orthographic camera may have half a
 * room there. camera_project rejects a b behind the far plane. */
static bool is_visible_from_camera(const struct path_context *c, const struct path_vertex *eye,
				   const struct path_vertex *b)
{
	struct camera storage;
	const struct camera *camera = world_camera_at(c->w, &eye->x, &storage);
	bool at_infinity = b->kind == VERTEX_INFINITE;
	vec3 d = at_infinity ? b->x.p : vec3_sub(b->x.p, eye->x.p);
	if (!camera_sees_direction(camera, d))
		return false;
	double t_min, t_max;
	camera_clip_range(camera, d, &t_min, &t_max);
	struct ray_end from = ray_end_of(eye), to = ray_end_of(b);
	struct ray_hit hit;
	if (at_infinity)
		return !accel_closest(c->w->accel, &from, d, t_min, t_max, &hit);
	if (!(t_min < 1))
		return false;
	from.p = vec3_madd(eye->x.p, t_min, d);
	return !accel_occluded(c->w->accel, &from, &to);
}

bool path_is_visible(struct path_context *c, const struct path_vertex *a, const struct path_vertex *b)
{
	c->counters[COUNT_RAYS_SHADOW]++;
	if (a->kind == VERTEX_CAMERA)
		return is_visible_from_camera(c, a, b);
	struct ray_end from = ray_end_of(a);
	if (b->kind == VERTEX_INFINITE)
		return !accel_occluded_to_infinity(c->w->accel, &from, b->x.p);
	struct ray_end to = ray_end_of(b);
	return !accel_occluded(c->w->accel, &from, &to);
}

double path_ray_t_min(const struct world *w, const struct path_vertex *from, vec3 d)
{
	double t_min = 0, t_max;
	struct camera storage;
	if (from->kind == VERTEX_CAMERA)
		camera_clip_range(world_camera_at(w, &from->x, &storage), d, &t_min, &t_max);
	return t_min;
}
