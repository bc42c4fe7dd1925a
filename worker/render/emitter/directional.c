/* SPDX-License-Identifier: Apache-2.0 */
/* Parallel light from infinity, given by its irradiance on a plane perpendicular to the direction in which it travels:
 * `direction`, or +z of to_world. */
#include "worker/render/emitter/delta.h"

static spectrum radiance(const struct emitter *em, const struct emitter_point *x, vec3 w, const struct wavelengths *wl)
{
	(void)x, (void)w;
	const struct delta_light *l = em->data;
	return color_eval(&l->color, wl);
}

static int create(struct emitter *em, const struct scene_node *n, const struct emitter_build *build, struct error *e)
{
	struct delta_light *l = em->data;
	int code = delta_check_exclusive(n, "direction", e);
	if (code)
		return code;
	mat4 to_world = node_transform(n, "to_world");
	const struct property *direction = node_find_property(n, "direction");
	vec3 d = direction ? direction->value.as.point : mat4_vector(&to_world, (vec3){0, 0, 1});
	double length = hypot(hypot(d.x, d.y), d.z);
	if (!(length > 0) || !isfinite(length))
		return node_error(n, e, EINVAL, "a direction of length %g", length);
	d = (vec3){d.x / length, d.y / length, d.z / length};
	l->point = (struct emitter_point){.p = vec3_neg(vec3_normalize(d)), .is_infinite = true};
	code = delta_create(em, n, "irradiance", 1, build, e);
	if (!code)
		em->power = delta_strength(l);
	return code;
}

static void set_transform(struct emitter *em, const mat4 *to_world)
{
	struct delta_light *l = em->data;
	l->point.p = vec3_neg(vec3_normalize(mat4_vector(to_world, (vec3){0, 0, 1})));
}

const struct emitter_ops emitter_ops_directional = {
	.decl = PLUGIN(EMITTER, "directional", {.name = "irradiance", .types = VALUE_COLOR, .max = PARAM_LIGHT_MAX},
		       {.name = "direction", .types = VALUE_POINT, .min = -PARAM_LENGTH_MAX, .max = PARAM_LENGTH_MAX},
		       {.name = "to_world", .types = VALUE_TRANSFORM_OR_ANIMATION},
		       {.name = "angle", .types = VALUE_FLOAT | VALUE_INT, .status = PARAM_DIFFERS}, /* of the cone */
		       {.name = "sampling_weight", .types = VALUE_FLOAT | VALUE_INT, .status = PARAM_IGNORED}),
	.data_size = sizeof(struct delta_light),
	.create = create,
	.radiance = radiance,
	DELTA_OPS,
	.set_transform = set_transform,
};
