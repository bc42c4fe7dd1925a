/* SPDX-License-Identifier: Apache-2.0 */
/* A point at `position`, or at the origin of to_world, that emits `intensity` in all directions. */
#include "worker/render/emitter/delta.h"
#include "worker/render/emitter/uniform.h"

static spectrum radiance(const struct emitter *em, const struct emitter_point *x, vec3 w, const struct wavelengths *wl)
{
	(void)x, (void)w;
	const struct delta_light *l = em->data;
	return spectrum_scale(l->factor, color_eval(&l->color, wl));
}

static bool sample_direction(const struct emitter *em, const struct emitter_point *x, const double u[2], vec3 *w,
			     double *pdf_solid)
{
	(void)em, (void)x;
	*w = vec3_normalize(sphere_from_square(u));
	*pdf_solid = 1 / (4 * M_PI);
	return true;
}

static double pdf_direction(const struct emitter *em, const struct emitter_point *x, vec3 w)
{
	(void)em, (void)x, (void)w;
	return 1 / (4 * M_PI);
}

static int create(struct emitter *em, const struct scene_node *n, const struct emitter_build *build, struct error *e)
{
	struct delta_light *l = em->data;
	int code = delta_check_exclusive(n, "position", e);
	if (code)
		return code;
	mat4 to_world = node_transform(n, "to_world");
	const struct property *position = node_find_property(n, "position");
	vec3 p = position ? position->value.as.point : mat4_point(&to_world, (vec3){0, 0, 0});
	l->point.p = vec3_scale(build->world_scale, vec3_sub(p, build->world_center));
	code = delta_create(em, n, "intensity", build->world_scale * build->world_scale, build, e);
	if (!code)
		em->power = 4 * M_PI * delta_strength(l);
	return code;
}

static void set_transform(struct emitter *em, const mat4 *to_world)
{
	struct delta_light *l = em->data;
	l->point.p = mat4_point(to_world, (vec3){0, 0, 0});
}

const struct emitter_ops emitter_ops_point = {
	.decl = PLUGIN(EMITTER, "point", {.name = "intensity", .types = VALUE_COLOR, .max = PARAM_LIGHT_MAX},
		       {.name = "position", .types = VALUE_POINT, .min = -PARAM_LENGTH_MAX, .max = PARAM_LENGTH_MAX},
		       {.name = "to_world", .types = VALUE_TRANSFORM_OR_ANIMATION},
		       {.name = "sampling_weight", .types = VALUE_FLOAT | VALUE_INT, .status = PARAM_IGNORED}),
	.data_size = sizeof(struct delta_light),
	.create = create,
	.radiance = radiance,
	DELTA_OPS,
	.sample_direction = sample_direction,
	.pdf_direction = pdf_direction,
	.set_transform = set_transform,
};
