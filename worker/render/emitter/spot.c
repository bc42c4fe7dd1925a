/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A point that emits into a cone around +z of to_world: `intensity` up to the angle `beam_width` from the axis, and
 * from there falling linearly with the angle to 0 at `cutoff_angle` (in degrees; by default the cut-off is 20, and the
 * beam width 3/4 of it). Light sub-paths are sampled uniformly over the cone. A `texture` multiplies the intensity: on
 * a plane across the axis, its unit square, upright, circumscribes the cone.
 */
#include "worker/render/emitter/delta.h"
#include "worker/render/math/frame.h"

struct spot {
	struct delta_light light;
	struct frame axes;
	double cutoff, beam_width; /* radians */
	double cap_height;	   /* of the cone: 1 - cos(cutoff) */
	bool has_texture;
	struct texture texture;
	vec3 texture_axes[3]; /* unit vectors */
	double cutoff_slope;  /* tan(cutoff) */
};

static double falloff(const struct spot *s, vec3 w)
{
	double angle = atan2(vec3_length(vec3_cross(s->axes.n, w)), vec3_dot(s->axes.n, w));
	if (angle >= s->cutoff)
		return 0;
	return angle <= s->beam_width ? 1 : (s->cutoff - angle) / (s->cutoff - s->beam_width);
}

static spectrum radiance(const struct emitter *em, const struct emitter_point *x, vec3 w, const struct wavelengths *wl)
{
	(void)x;
	const struct spot *s = em->data;
	double part = falloff(s, w);
	spectrum intensity = spectrum_scale(s->light.factor * part, color_eval(&s->light.color, wl));
	if (!s->has_texture || !(part > 0))
		return intensity;
	double z = 2 * s->cutoff_slope * vec3_dot(s->texture_axes[2], w);
	const struct texture_point point = {.u = 0.5 + vec3_dot(s->texture_axes[0], w) / z,
					    .v = 0.5 + vec3_dot(s->texture_axes[1], w) / z};
	return spectrum_mul(intensity, texture_eval(&s->texture, &point, wl));
}

static bool sample_direction(const struct emitter *em, const struct emitter_point *x, const double u[2], vec3 *w,
			     double *pdf_solid)
{
	(void)x;
	const struct spot *s = em->data;
	double down = u[0] * s->cap_height, r = sqrt(down * (2 - down)), phi = 2 * M_PI * u[1];
	*w = vec3_normalize(frame_to_world(&s->axes, (vec3){r * cos(phi), r * sin(phi), 1 - down}));
	*pdf_solid = 1 / (2 * M_PI * s->cap_height);
	return true;
}

static double pdf_direction(const struct emitter *em, const struct emitter_point *x, vec3 w)
{
	(void)x;
	const struct spot *s = em->data;
	return falloff(s, w) > 0 ? 1 / (2 * M_PI * s->cap_height) : 0;
}

static int read_texture(struct emitter *em, struct spot *s, const struct scene_node *n, const mat4 *to_world,
			const struct emitter_build *build, struct error *e)
{
	const struct property *property = node_find_property(n, "texture");
	/* 0.6 ignores a colour or a number. */
	s->has_texture = property && (build->is_dialect_3 || property->value.type == VALUE_NODE);
	if (!s->has_texture)
		return 0;
	if (s->cutoff > 89 * (M_PI / 180))
		return node_error(n, e, EINVAL, "a texture needs a cutoff_angle of at most 89 degrees");
	int code = emitter_read_texture(&s->texture, n, "texture", COLOR_REFLECTANCE, build, e);
	if (!code)
		code = delta_read_axes(n, to_world, s->texture_axes, e);
	if (code)
		return code;
	s->cutoff_slope = tan(s->cutoff);
	em->is_textured = !texture_is_constant(&s->texture);
	if (texture_color_kind(&s->texture) != COLOR_KIND_CONSTANT)
		em->color_kind = COLOR_KIND_OTHER;
	em->brightness_bound *= texture_max(&s->texture);
	em->power *= texture_max(&s->texture);
	return 0;
}

static int create(struct emitter *em, const struct scene_node *n, const struct emitter_build *build, struct error *e)
{
	struct spot *s = em->data;
	mat4 to_world = node_transform(n, "to_world");
	vec3 axis = vec3_normalize(mat4_vector(&to_world, (vec3){0, 0, 1}));
	if (!vec3_is_finite(axis))
		return node_error(n, e, EINVAL, "to_world gives the spot no direction");
	double cutoff = node_float(n, "cutoff_angle", 20), beam_width = node_float(n, "beam_width", 0.75 * cutoff);
	if (beam_width > cutoff)
		return node_error(n, e, EINVAL, "beam_width=%g exceeds cutoff_angle=%g", beam_width, cutoff);
	s->axes = frame_around(axis);
	s->cutoff = cutoff * (M_PI / 180);
	s->beam_width = beam_width * (M_PI / 180);
	s->cap_height = 2 * pow(sin(0.5 * s->cutoff), 2);
	s->light.point.p = delta_origin(&to_world, build);
	int code = delta_create(em, n, "intensity", build->world_scale * build->world_scale, build, e);
	if (code)
		return code;
	/* The integral of the fall-off over the cone is 2 pi (1 - slope). */
	double slope = s->cutoff > s->beam_width ? (sin(s->cutoff) - sin(s->beam_width)) / (s->cutoff - s->beam_width)
						 : cos(s->cutoff);
	em->power = 2 * M_PI * (1 - slope) * delta_strength(&s->light);
	return read_texture(em, s, n, &to_world, build, e);
}

/* delta_axes_from_transform cannot fail: a moving transform has an inverse and its determinant keeps its sign, so it
 * has axes at every time if `create` accepted it. */
static void set_transform(struct emitter *em, const mat4 *to_world)
{
	struct spot *s = em->data;
	s->light.point.p = mat4_point(to_world, (vec3){0, 0, 0});
	s->axes = frame_around(vec3_normalize(mat4_vector(to_world, (vec3){0, 0, 1})));
	if (s->has_texture)
		delta_axes_from_transform(to_world, s->texture_axes);
}

const struct emitter_ops emitter_ops_spot = {
	.decl = PLUGIN(EMITTER, "spot", {.name = "intensity", .types = VALUE_COLOR, .max = PARAM_LIGHT_MAX},
		       {.name = "to_world", .types = VALUE_TRANSFORM_OR_ANIMATION},
		       {.name = "cutoff_angle", .types = VALUE_FLOAT | VALUE_INT, .min = 0.01, .max = 180},
		       {.name = "beam_width", .types = VALUE_FLOAT | VALUE_INT, .min = 0, .max = 180},
		       {.name = "texture", .types = VALUE_TEXTURE, .max = 1},
		       {.name = "sampling_weight", .types = VALUE_FLOAT | VALUE_INT, .status = PARAM_IGNORED}),
	.data_size = sizeof(struct spot),
	.create = create,
	.radiance = radiance,
	DELTA_OPS,
	.sample_direction = sample_direction,
	.pdf_direction = pdf_direction,
	.set_transform = set_transform,
};
