/* SPDX-License-Identifier: Apache-2.0 */
/* `scale` of 0.5/0.6: a texture, or a colour, times a number; for colours, also times a colour or, as an extension, a
 * texture. Reflectances are limited to 1. */
#include "worker/render/texture/texture.h"

struct scale {
	struct texture inner;
	double factor;
	struct color tint; /* its largest component is 1 */
	bool has_tint;
	struct texture factor_texture; /* factor given as a texture; otherwise the constant 1 */
	enum color_role role;
};

/* Splits a colour into its largest component and a reflectance. */
static int read_tint(struct scale *s, const struct scene_node *n, const struct property *p, struct error *e)
{
	const double *rgb = p->value.as.rgb;
	double max_component = fmax(rgb[0], fmax(rgb[1], rgb[2])), unit[3] = {0, 0, 0};
	if (color_role_is_number(s->role))
		return node_error(n, e, EINVAL, "scale is a number here, not a colour");
	if (fmin(rgb[0], fmin(rgb[1], rgb[2])) < 0)
		return node_error(n, e, ERANGE, "scale makes negative colours");
	for (int k = 0; k < 3 && max_component > 0; k++)
		unit[k] = rgb[k] / max_component;
	s->factor = max_component;
	s->has_tint = true;
	return color_from_rgb(unit, COLOR_REFLECTANCE, &s->tint);
}

static int read_factor_texture(struct scale *s, const struct scene_node *n, const struct texture_build *build,
			       struct error *e)
{
	if (color_role_is_number(s->role))
		return node_error(n, e, EINVAL, "scale is a number here, not a texture");
	return texture_create(&s->factor_texture, node_ref(n, "scale"), COLOR_REFLECTANCE, build, e);
}

static int scale_create(struct texture *t, const struct scene_node *n, enum color_role role,
			const struct texture_build *build, struct error *e)
{
	struct scale *s = t->data;
	s->role = role;
	const struct property *scale = node_find_property(n, "scale");
	int code = scale && scale->value.type == VALUE_RGB ? read_tint(s, n, scale, e) : 0;
	s->factor_texture = (struct texture){.color = color_constant(1)};
	if (!code && node_ref(n, "scale"))
		code = read_factor_texture(s, n, build, e);
	if (code)
		return code;
	if (!s->has_tint)
		s->factor = node_ref(n, "scale") ? 1 : node_float(n, "scale", 1);
	const struct scene_node *inner = node_child(n, PLUGIN_TEXTURE, 0);
	if (!inner && !node_find_property(n, "value"))
		return node_error(n, e, EINVAL, "needs a texture inside, or a colour, `value`");
	if (s->factor < 0 && !color_role_is_number(role))
		return node_error(n, e, ERANGE, "scale=%g makes negative colours", s->factor);
	return inner ? texture_create(&s->inner, inner, role, build, e)
		     : texture_from_node(&s->inner, n, "value", 0, role, build, e);
}

static spectrum scale_eval(const struct texture *t, const struct texture_point *point, const struct wavelengths *w)
{
	const struct scale *s = t->data;
	spectrum x = spectrum_scale(s->factor, texture_eval(&s->inner, point, w));
	if (s->has_tint)
		x = spectrum_mul(x, color_eval(&s->tint, w));
	if (s->factor_texture.ops)
		x = spectrum_mul(x, texture_eval(&s->factor_texture, point, w));
	for (int i = 0; s->role == COLOR_REFLECTANCE && i < SPECTRUM_LANES; i++)
		x.v[i] = fmin(x.v[i], 1);
	return x;
}

static double scale_height(const struct texture *t, double u, double v)
{
	const struct scale *s = t->data;
	return s->factor * texture_height(&s->inner, u, v);
}

static void scale_eval_derivatives(const struct texture *t, double u, double v, struct texture_derivatives *j)
{
	const struct scale *s = t->data;
	texture_eval_derivatives(&s->inner, u, v, j);
	for (int k = 0; k < 3; k++) {
		j->x[k] *= s->factor;
		j->du[k] *= s->factor;
		j->dv[k] *= s->factor;
		j->duu[k] *= s->factor;
		j->duv[k] *= s->factor;
		j->dvv[k] *= s->factor;
	}
}

static double scale_max(const struct texture *t)
{
	const struct scale *s = t->data;
	double m = s->factor * texture_max(&s->inner) * texture_max(&s->factor_texture);
	return s->role == COLOR_REFLECTANCE ? fmin(m, 1) : m;
}

static double scale_aspect(const struct texture *t)
{
	return texture_aspect(&((const struct scale *)t->data)->inner);
}

/* Clamping at 1 does not change the color_kind: only reflectances are clamped, which are CONSTANT or OTHER. */
static enum color_kind scale_color_kind(const struct texture *t)
{
	const struct scale *s = t->data;
	bool coloured = (s->has_tint && s->tint.kind != COLOR_KIND_CONSTANT) ||
			texture_color_kind(&s->factor_texture) != COLOR_KIND_CONSTANT;
	return coloured ? COLOR_KIND_OTHER : texture_color_kind(&s->inner);
}

const struct texture_ops texture_ops_scale = {
	.decl = {PLUGIN_TEXTURE, "scale",
		 PARAMS({.name = "scale",
			 .types = VALUE_FLOAT | VALUE_INT | VALUE_RGB | VALUE_NODE,
			 .min = -PARAM_LIGHT_MAX,
			 .max = PARAM_LIGHT_MAX},
			{.name = "value", .types = VALUE_TEXTURE, .min = -PARAM_LIGHT_MAX, .max = PARAM_LIGHT_MAX}),
		 1u << PLUGIN_TEXTURE, PARAM_UNDERSTOOD},
	.data_size = sizeof(struct scale),
	.create = scale_create,
	.eval = scale_eval,
	.height = scale_height,
	.eval_derivatives = scale_eval_derivatives,
	.max = scale_max,
	.color_kind = scale_color_kind,
	.aspect = scale_aspect,
};
