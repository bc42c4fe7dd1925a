/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/path/visible.h"

static struct ray_end end_of(const struct path_vertex *v)
{
	return (struct ray_end){v->x.p, v->kind == VERTEX_CAMERA ? (vec3){0, 0, 0} : v->x.ng, v->x.prim};
}

/* Whether the camera sees b. Surfaces in front of the near plane hide nothing: an orthographic camera may have half a
 * room there. camera_project rejects a b behind the far plane. */
static bool seen_by_camera(const struct path_context *c, const struct path_vertex *eye, const struct path_vertex *b)
{
	struct camera room;
	const struct camera *camera = world_camera(c->w, &eye->x, &room);
	bool endless = b->kind == VERTEX_INFINITE;
	vec3 d = endless ? b->x.p : vec3_sub(b->x.p, eye->x.p);
	if (!camera_looks(camera, d))
		return false;
	double t_min, t_max;
	camera_clip(camera, d, &t_min, &t_max);
	struct ray_end from = end_of(eye), to = end_of(b);
	struct ray_hit hit;
	if (endless)
		return !accel_closest(c->w->accel, &from, d, t_min, t_max, &hit);
	if (!(t_min < 1))
		return false;
	from.p = vec3_madd(eye->x.p, t_min, d);
	return !accel_occluded(c->w->accel, &from, &to);
}

bool path_visible(struct path_context *c, const struct path_vertex *a, const struct path_vertex *b)
{
	c->counters[COUNT_RAYS_SHADOW]++;
	if (a->kind == VERTEX_CAMERA)
		return seen_by_camera(c, a, b);
	struct ray_end from = end_of(a);
	if (b->kind == VERTEX_INFINITE)
		return !accel_occluded_to_infinity(c->w->accel, &from, b->x.p);
	struct ray_end to = end_of(b);
	return !accel_occluded(c->w->accel, &from, &to);
}

double path_ray_begin(const struct world *w, const struct path_vertex *from, vec3 d)
{
	double t_min = 0, t_max;
	struct camera room;
	if (from->kind == VERTEX_CAMERA)
		camera_clip(world_camera(w, &from->x, &room), d, &t_min, &t_max);
	return t_min;
}
