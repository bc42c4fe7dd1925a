/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A pinhole that projects a picture: the inverse of the perspective camera, with the same axes, `fov` and `fov_axis`
 * (applied to the shape of the picture). The picture is the irradiance on a plane across the axis at distance 1,
 * divided by pi: a direction at the angle t from the axis gets the intensity
 *
 *     I = pi scale irradiance(u,v) / cos^3 t,
 *
 * so that a plane at distance z receives pi scale irradiance / z^2 everywhere, as in Mitsuba. Light sub-paths are
 * sampled uniformly over the picture; their density is 1 / (A cos^3 t) per solid angle, with A the area of the picture
 * at distance 1.
 */
#include "worker/render/emitter/delta.h"
#include "worker/render/scene/fov.h"

struct projector {
	struct delta_light light; /* light.color is unused */
	struct texture irradiance;
	vec3 axes[3];	       /* unit; u of the picture runs along -x, v along -y, as in a camera */
	double half_extent[2]; /* half the width and height of the picture at distance 1 */
};

/* Finds the point (u,v) of the picture in direction w, and the cosine of w to the axis. Returns false if w misses the
 * picture. */
static bool find_picture_point(const struct projector *p, vec3 w, double uv[2], double *cosine)
{
	*cosine = vec3_dot(p->axes[2], w);
	if (!(*cosine > 0))
		return false;
	for (int i = 0; i < 2; i++)
		uv[i] = 0.5 - 0.5 * vec3_dot(p->axes[i], w) / (*cosine * p->half_extent[i]);
	return uv[0] >= 0 && uv[0] <= 1 && uv[1] >= 0 && uv[1] <= 1;
}

static double picture_area(const struct projector *p)
{
	return 4 * p->half_extent[0] * p->half_extent[1];
}

static spectrum radiance(const struct emitter *em, const struct emitter_point *x, vec3 w, const struct wavelengths *wl)
{
	(void)x;
	const struct projector *p = em->data;
	double uv[2], c;
	if (!find_picture_point(p, w, uv, &c))
		return spectrum_constant(0);
	const struct texture_point point = {.u = uv[0], .v = uv[1]};
	return spectrum_scale(M_PI * p->light.factor / (c * c * c), texture_eval(&p->irradiance, &point, wl));
}

static bool sample_direction(const struct emitter *em, const struct emitter_point *x, const double u[2], vec3 *w,
			     double *pdf_solid)
{
	(void)x;
	const struct projector *p = em->data;
	vec3 d = p->axes[2];
	for (int i = 0; i < 2; i++)
		d = vec3_madd(d, (1 - 2 * u[i]) * p->half_extent[i], p->axes[i]);
	double length = vec3_length(d);
	*w = vec3_scale(1 / length, d);
	*pdf_solid = length * length * length / picture_area(p);
	return true;
}

static double pdf_direction(const struct emitter *em, const struct emitter_point *x, vec3 w)
{
	(void)x;
	const struct projector *p = em->data;
	double uv[2], c;
	return find_picture_point(p, w, uv, &c) ? 1 / (picture_area(p) * c * c * c) : 0;
}

static int create(struct emitter *em, const struct scene_node *n, const struct emitter_build *build, struct error *e)
{
	struct projector *p = em->data;
	mat4 to_world = node_transform(n, "to_world");
	double degrees, scale = node_float(n, "scale", 1);
	char axis[FOV_AXIS_MAX];
	p->light.point.p = delta_origin(&to_world, build);
	int code = delta_read_axes(n, &to_world, p->axes, e);
	if (!code)
		code = fov_read(n, &degrees, axis, e);
	if (!code)
		code = emitter_read_texture(&p->irradiance, n, "irradiance", COLOR_ILLUMINANT, build, e);
	if (!code)
		code = delta_init(em, n, scale * build->world_scale * build->world_scale, e);
	if (code)
		return code;
	double aspect = texture_aspect(&p->irradiance), slope = tan(degrees * (M_PI / 360)) / fov_side(axis, aspect, 1);
	p->half_extent[0] = aspect * slope;
	p->half_extent[1] = slope;
	em->is_textured = !texture_is_constant(&p->irradiance);
	em->color_kind = texture_color_kind(&p->irradiance);
	double max_intensity = M_PI * p->light.factor * texture_max(&p->irradiance);
	double corner = sqrt(1 + p->half_extent[0] * p->half_extent[0] + p->half_extent[1] * p->half_extent[1]);
	em->power = max_intensity * picture_area(p);
	em->brightness_bound = DELTA_HEADROOM * max_intensity * corner * corner * corner;
	return 0;
}

static void set_transform(struct emitter *em, const mat4 *to_world)
{
	struct projector *p = em->data;
	p->light.point.p = mat4_point(to_world, (vec3){0, 0, 0});
	delta_axes_from_transform(to_world, p->axes);
}

const struct emitter_ops emitter_ops_projector = {
	.decl = PLUGIN(EMITTER, "projector", {.name = "irradiance", .types = VALUE_TEXTURE, .max = PARAM_LIGHT_MAX},
		       {.name = "scale", .types = VALUE_FLOAT | VALUE_INT, .min = 1e-30, .max = PARAM_LIGHT_MAX},
		       {.name = "to_world", .types = VALUE_TRANSFORM_OR_ANIMATION},
		       {.name = "fov", .types = VALUE_FLOAT | VALUE_INT, .min = 1e-4, .max = 179.9},
		       {.name = "fov_axis", .types = VALUE_STRING, .choices = "x|y|diagonal|smaller|larger"},
		       {.name = "focal_length", .types = VALUE_STRING},
		       {.name = "sampling_weight", .types = VALUE_FLOAT | VALUE_INT, .status = PARAM_IGNORED}),
	.data_size = sizeof(struct projector),
	.create = create,
	.radiance = radiance,
	DELTA_OPS,
	.sample_direction = sample_direction,
	.pdf_direction = pdf_direction,
	.set_transform = set_transform,
};
