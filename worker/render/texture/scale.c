/* SPDX-License-Identifier: Apache-2.0 */
/* Another texture times a number: 0.5/0.6. Reflectances end at 1. */
#include "worker/render/texture/texture.h"

struct scale {
	struct texture inner;
	double factor;
	enum color_role role;
};

static int scale_create(struct texture *t, const struct scene_node *n, enum color_role role,
			const struct asset_source *assets, bool dialect_3, struct arena *arena, struct error *e)
{
	struct scale *s = arena_alloc(arena, 1, sizeof *s);
	if (!s)
		return node_error(n, e, ENOMEM, "out of memory");
	t->data = s;
	s->role = role;
	s->factor = node_float(n, "scale", 1);
	const struct scene_node *inner = node_child(n, PLUGIN_TEXTURE, 0);
	if (!inner)
		return node_error(n, e, EINVAL, "needs a texture inside");
	if (s->factor < 0 && !color_role_is_number(role))
		return node_error(n, e, ERANGE, "scale=%g makes negative colours", s->factor);
	return texture_create(&s->inner, inner, role, assets, dialect_3, arena, e);
}

static spectrum scale_eval(const struct texture *t, double u, double v, const struct wavelengths *w)
{
	const struct scale *s = t->data;
	spectrum x = spectrum_scale(s->factor, texture_eval(&s->inner, u, v, w));
	for (int i = 0; s->role == COLOR_REFLECTANCE && i < SPECTRUM_LANES; i++)
		x.v[i] = fmin(x.v[i], 1);
	return x;
}

static double scale_height(const struct texture *t, double u, double v)
{
	const struct scale *s = t->data;
	return s->factor * texture_height(&s->inner, u, v);
}

static void scale_jet(const struct texture *t, double u, double v, struct texture_jet *j)
{
	const struct scale *s = t->data;
	texture_jet(&s->inner, u, v, j);
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
	double m = s->factor * texture_max(&s->inner);
	return s->role == COLOR_REFLECTANCE ? fmin(m, 1) : m;
}

/* What is cut off at 1 has another shape, unless it had none. */
static enum color_shape scale_shape(const struct texture *t)
{
	return texture_shape(&((const struct scale *)t->data)->inner);
}

static const struct param scale_params[] = {
	{.name = "scale", .types = VALUE_FLOAT | VALUE_INT, .min = -PARAM_LIGHT_MAX, .max = PARAM_LIGHT_MAX},
	{.name = NULL},
};

const struct texture_ops texture_ops_scale = {
	.type = "scale",
	.params = scale_params,
	.nested_classes = 1u << PLUGIN_TEXTURE,
	.create = scale_create,
	.eval = scale_eval,
	.height = scale_height,
	.jet = scale_jet,
	.max = scale_max,
	.shape = scale_shape,
};
