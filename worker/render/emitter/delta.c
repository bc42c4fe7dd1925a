/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/emitter/delta.h"

int delta_create(struct emitter *em, const struct scene_node *n, const char *name, double factor,
		 const struct emitter_build *build, struct error *e)
{
	struct delta_light *l = em->data;
	struct texture t;
	int code = emitter_read_texture(&t, n, name, COLOR_ILLUMINANT, build, e);
	if (!code)
		code = delta_init(em, n, factor, e);
	if (code)
		return code;
	l->color = t.color;
	em->color_kind = l->color.kind;
	em->brightness_bound = DELTA_HEADROOM * factor * color_max(&l->color);
	return 0;
}

int delta_init(struct emitter *em, const struct scene_node *n, double factor, struct error *e)
{
	struct delta_light *l = em->data;
	double distance = vec3_length(l->point.p);
	if (!(distance <= PARAM_DISTANCE_MAX))
		return node_error(n, e, ERANGE, "is %g scene radii away from the scene, more than %g", distance,
				  PARAM_DISTANCE_MAX);
	if (!(factor > 0) || !isfinite(factor))
		return node_error(n, e, EINVAL, "this light's strength is out of range at the scene's size");
	l->factor = factor;
	em->is_delta = true;
	em->is_infinite = l->point.is_infinite;
	return 0;
}

bool delta_axes_from_transform(const mat4 *to_world, vec3 axes[3])
{
	vec3 x = mat4_vector(to_world, (vec3){1, 0, 0}), y = mat4_vector(to_world, (vec3){0, 1, 0});
	vec3 z = vec3_normalize(mat4_vector(to_world, (vec3){0, 0, 1}));
	axes[2] = z;
	axes[1] = vec3_normalize(vec3_madd(y, -vec3_dot(y, z), z));
	axes[0] = vec3_cross(axes[1], z);
	double side = vec3_dot(x, axes[0]);
	if (side < 0)
		axes[0] = vec3_neg(axes[0]);
	return vec3_is_finite(z) && vec3_is_finite(axes[1]) && fabs(side) > 0;
}

int delta_read_axes(const struct scene_node *n, const mat4 *to_world, vec3 axes[3], struct error *e)
{
	return delta_axes_from_transform(to_world, axes)
		       ? 0
		       : node_error(n, e, EINVAL, "the to_world transform is singular");
}

double delta_strength(const struct delta_light *l)
{
	return l->factor * color_mean(&l->color);
}

int delta_check_exclusive(const struct scene_node *n, const char *name, struct error *e)
{
	if (node_find_property(n, name) && node_find_property(n, "to_world"))
		return node_error(n, e, EINVAL, "%s and to_world are both given: only one is allowed", name);
	return 0;
}

vec3 delta_origin(const mat4 *to_world, const struct emitter_build *build)
{
	return vec3_scale(build->world_scale, vec3_sub(mat4_point(to_world, (vec3){0, 0, 0}), build->world_center));
}

bool delta_sample_point(const struct emitter *em, const double u[2], struct emitter_point *x, double *pdf_point)
{
	(void)u;
	*x = ((const struct delta_light *)em->data)->point;
	*pdf_point = 1;
	return true;
}

double delta_pdf_point(const struct emitter *em, const struct emitter_point *x)
{
	(void)em, (void)x;
	return 1;
}
