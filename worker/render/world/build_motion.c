/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/world/build_motion.h"

#include "worker/render/world/place_mesh.h"

/* Relative tolerance: matrices in files have six digits. */
#define TOLERANCE 1e-5

/* Whether m consists only of translation, rotation, reflection and one scale for all directions, which *scale
 * receives. */
static bool is_similarity(const mat4 *m, double *scale)
{
	const vec3 x = mat4_column(m, 0), y = mat4_column(m, 1), z = mat4_column(m, 2);
	double s2 = vec3_dot(x, x), tolerance = TOLERANCE * s2;
	*scale = sqrt(s2);
	return fabs(vec3_dot(y, y) - s2) <= tolerance && fabs(vec3_dot(z, z) - s2) <= tolerance &&
	       fabs(vec3_dot(x, y)) <= tolerance && fabs(vec3_dot(y, z)) <= tolerance &&
	       fabs(vec3_dot(z, x)) <= tolerance;
}

/* Checks the motion: spheres must stay spheres, and displaced shapes, whose displacement is in scene
 * units, must keep their size. */
static int check_motion(const struct builder *b, const struct listed_shape *l, uint32_t id, const struct motion *m)
{
	bool sphere = b->geometry[id].kind == SHAPE_SPHERE;
	if (!sphere && !build_is_displaced(b, l->node))
		return 0;
	for (uint32_t i = 0; i < m->count; i++) {
		double scale;
		mat4 at = motion_transform_at(m, m->key[i].time);
		if (!is_similarity(&at, &scale) || (!sphere && !(fabs(scale - 1) <= TOLERANCE)))
			return node_error(l->node, b->e, ENOTSUP,
					  sphere ? "a sphere that moves may not be stretched in one direction"
						 : "a displaced shape that moves may not change its size");
	}
	return 0;
}

/* Computes how an object moves while the shutter is open. *moves: it moves at all. */
static int make_motion(struct builder *b, const struct scene_node *n, const struct animation *a, struct motion **out,
		       bool *moves)
{
	const struct scene_settings *s = &b->w->settings;
	struct motion *m = *out = arena_alloc(&b->w->arena, 1, sizeof *m);
	struct motion_key *keys = arena_alloc(&b->w->arena, a->count, sizeof *keys);
	if (!m || !keys)
		return build_out_of_memory(b->e);
	*moves = motion_make(m, a, s->shutter_open, s->shutter_close, keys);
	/* If the shutter is open for 1 unit of time, it does not matter whether the exposure of a line is given as a
	 * time or as a fraction of the shutter's. */
	bool shutter_is_unit = fabs(s->shutter_close - s->shutter_open - 1) < 1e-9;
	return *moves && s->rolling_shutter != ROLL_NONE && !shutter_is_unit
		       ? node_error(n, b->e, ENOTSUP,
				    "it moves, and a rolling shutter is only supported if shutter_close is 1 after "
				    "shutter_open")
		       : 0;
}

int build_motion_begin(struct builder *b, const struct listed_shape *l, uint32_t id, struct box start_box)
{
	const struct scene_node *outer = l->instance ? l->instance : l->node;
	bool moves;
	int rc = make_motion(b, outer, l->animation, &b->motions[id], &moves);
	if (rc)
		return rc;
	struct motion *m = b->motions[id];
	bool in_group = l->instance && b->shared_meshes[id];
	if (!in_group && !mat4_invert(node_transform(outer, "to_world"), &m->pre_transform))
		return node_error(outer, b->e, EINVAL, "to_world flattens it (it has no inverse)");
	rc = check_motion(b, l, id, m);
	if (rc)
		return rc;
	struct box *bounds = &b->shape_boxes[id];
	motion_bounds(m, start_box.min, start_box.max, &bounds->min, &bounds->max);
	double max_norm = fmax(triangle_norm_max(bounds->min), triangle_norm_max(bounds->max));
	return max_norm <= MESH_COORDINATE_MAX
		       ? 0
		       : node_error(outer, b->e, ERANGE, "it moves beyond %g", MESH_COORDINATE_MAX);
}

int build_motion_place(struct builder *b, uint32_t id, vec3 center, double scale, const struct box *box,
		       struct placement *p)
{
	const struct world *w = b->w;
	struct swept_motion *v = arena_alloc(&b->w->arena, 1, sizeof *v);
	if (!v)
		return -ENOMEM;
	const vec3 inverse_scale = {1 / scale, 1 / scale, 1 / scale};
	*v = (struct swept_motion){*b->motions[id], box->min, box->max};
	v->motion.pre_transform =
		mat4_mul(v->motion.pre_transform, mat4_mul(mat4_translate(center), mat4_scale(inverse_scale)));
	motion_rescale(&v->motion, w->center, w->scale);
	return placement_make_moving(p, v) ? 0 : -EINVAL;
}

int build_motion_place_sphere(struct builder *b, uint32_t id)
{
	struct geom_shape *g = &b->w->shapes[id];
	const vec3 r = {g->radius, g->radius, g->radius};
	const struct box box = {vec3_sub(g->center, r), vec3_add(g->center, r)};
	struct placement *p = arena_alloc(&b->w->arena, 1, sizeof *p);
	int rc = p ? build_motion_place(b, id, b->w->center, b->w->scale, &box, p) : -ENOMEM;
	if (rc == -ENOMEM)
		return build_out_of_memory(b->e);
	if (rc)
		return node_error(b->shape_nodes[id], b->e, EINVAL, "it becomes too small while it moves");
	p->first_shape = id;
	g->placement = p;
	return 0;
}

/* Checks that the position at each of m's times is within reach. */
static int check_reach(const struct builder *b, const struct scene_node *n, const struct motion *m)
{
	for (uint32_t i = 0; i < m->count; i++)
		if (!(vec3_length(m->key[i].translation) <= PARAM_DISTANCE_MAX))
			return node_error(n, b->e, ERANGE, "it moves more than %g scene radii away from the scene",
					  PARAM_DISTANCE_MAX);
	return 0;
}

/* Like check_reach(), but for an emitter; an environment has directions, which must keep their angles. */
static int check_emitter(const struct builder *b, const struct emitter *em, const struct scene_node *n,
			 const struct motion *m)
{
	if (!em->is_infinite)
		return check_reach(b, n, m);
	for (uint32_t i = 0; i < m->count && !em->is_delta; i++) {
		mat4 at = motion_transform_at(m, m->key[i].time);
		if (!mat4_is_conformal(&at))
			return node_error(n, b->e, ENOTSUP, "an environment that moves may only be turned");
	}
	return 0;
}

int build_motion_set_emitter(struct builder *b, struct emitter *em, const struct scene_node *n)
{
	struct world *w = b->w;
	const struct animation *a = node_animation(n);
	if (!a)
		return 0;
	struct motion *m;
	bool moves;
	int rc = make_motion(b, n, a, &m, &moves);
	if (rc)
		return rc;
	motion_rescale(m, w->center, w->scale);
	rc = check_emitter(b, em, n, m);
	if (rc)
		return rc;
	mat4 open = motion_transform_at(m, 0);
	em->ops->set_transform(em, &open);
	em->motion = moves ? m : NULL;
	return 0;
}

int build_motion_set_camera(struct builder *b)
{
	struct world *w = b->w;
	const struct scene_node *sensor = scene_sensor(b->scene, (uint32_t)w->accuracy.sensor);
	if (!w->settings.is_moving)
		return 0;
	const struct animation *a = node_animation(sensor);
	struct motion *m;
	bool moves;
	struct keyframe *upright = arena_alloc(&b->scratch, a->count, sizeof *upright);
	if (!upright)
		return build_out_of_memory(b->e);
	for (uint32_t i = 0; i < a->count; i++) {
		upright[i].time = a->key[i].time;
		if (!scene_settings_orthonormalize(a->key[i].transform, &upright[i].transform))
			return node_error(sensor, b->e, EINVAL,
					  "to_world may only rotate, translate, mirror and scale a camera");
	}
	int rc = make_motion(b, sensor, &(struct animation){a->count, upright}, &m, &moves);
	if (rc)
		return rc;
	motion_rescale(m, w->center, w->scale);
	w->camera.motion = m;
	return check_reach(b, sensor, m);
}
