/* SPDX-License-Identifier: Apache-2.0 */
/*
 * `collimated` of 0.5/0.6: `power` along a line without width, from the origin of to_world towards its +z.
 *
 * The position and the direction of a path's first edge are fixed, and so is its end: all paths from this light begin
 * alike, and only techniques that sample at least two vertices from the light can generate them. The delta distribution
 * of the direction is omitted from both power and density: along the beam, `radiance` is the power and the density 1,
 * elsewhere both are 0. No point is sampled for next event estimation.
 */
#include "worker/render/emitter/delta.h"

/* Tolerance for the direction between two vertices that have been offset or rounded. */
static const double direction_tolerance = 1e-7;

struct beam {
	struct delta_light light;
	vec3 axis;
};

static bool is_along(const struct emitter *em, vec3 w)
{
	const struct beam *b = em->data;
	return vec3_length(vec3_sub(w, b->axis)) <= direction_tolerance;
}

static spectrum radiance(const struct emitter *em, const struct emitter_point *x, vec3 w, const struct wavelengths *wl)
{
	(void)x;
	const struct beam *b = em->data;
	return is_along(em, w) ? spectrum_scale(b->light.factor, color_eval(&b->light.color, wl))
			       : spectrum_constant(0);
}

static bool sample_direction(const struct emitter *em, const struct emitter_point *x, const double u[2], vec3 *w,
			     double *pdf_solid)
{
	(void)x, (void)u;
	*w = ((const struct beam *)em->data)->axis;
	*pdf_solid = 1;
	return true;
}

static double pdf_direction(const struct emitter *em, const struct emitter_point *x, vec3 w)
{
	(void)x;
	return is_along(em, w) ? 1 : 0;
}

static bool sample_toward(const struct emitter *em, vec3 ref, const double u[2], struct emitter_point *x,
			  double *pdf_toward)
{
	(void)em, (void)ref, (void)u, (void)x, (void)pdf_toward;
	return false;
}

static double pdf_toward(const struct emitter *em, vec3 ref, const struct emitter_point *x)
{
	(void)em, (void)ref, (void)x;
	return 0;
}

static int create(struct emitter *em, const struct scene_node *n, const struct emitter_build *build, struct error *e)
{
	struct beam *b = em->data;
	mat4 to_world = node_transform(n, "to_world");
	b->axis = vec3_normalize(mat4_vector(&to_world, (vec3){0, 0, 1}));
	if (!vec3_is_finite(b->axis))
		return node_error(n, e, EINVAL, "to_world gives the beam no direction");
	b->light.point.p = delta_origin(&to_world, build);
	int code = delta_create(em, n, "power", build->world_scale * build->world_scale, build, e);
	if (code)
		return code;
	em->is_beam = true;
	em->power = delta_strength(&b->light);
	/* All of the light may come from one point, seen by one pixel: allow for pixels of a millionth of a
	 * steradian. */
	em->brightness_bound *= 0x1p20;
	return 0;
}

static void set_transform(struct emitter *em, const mat4 *to_world)
{
	struct beam *b = em->data;
	b->light.point.p = mat4_point(to_world, (vec3){0, 0, 0});
	b->axis = vec3_normalize(mat4_vector(to_world, (vec3){0, 0, 1}));
}

const struct emitter_ops emitter_ops_collimated = {
	.decl = PLUGIN(EMITTER, "collimated", {.name = "power", .types = VALUE_COLOR, .max = PARAM_LIGHT_MAX},
		       {.name = "to_world", .types = VALUE_TRANSFORM_OR_ANIMATION},
		       {.name = "sampling_weight", .types = VALUE_FLOAT | VALUE_INT, .status = PARAM_IGNORED}),
	.data_size = sizeof(struct beam),
	.create = create,
	.radiance = radiance,
	DELTA_OPS,
	.sample_direction = sample_direction,
	.pdf_direction = pdf_direction,
	.sample_toward = sample_toward,
	.pdf_toward = pdf_toward,
	.set_transform = set_transform,
};
