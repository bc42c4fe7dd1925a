/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Values at the vertices of a mesh, interpolated linearly, or one value per triangle: `mesh_attribute` of 3.x, and
 * `vertexcolors` of 0.5/0.6, which is the attribute vertex_color. Colours are interpolated in linear RGB and then
 * upsampled; a single channel is grey. Reflectances are clamped to [0,1], like those of images; quantities that may
 * exceed 1, such as a metal's `eta` and `k` or an exponent, are not clamped. Where the texture stands for a number, a
 * colour is the mean of its components.
 *
 * The derivatives of an attribute with respect to (u,v) are not known, so it cannot displace surfaces or bend normals.
 */
#include "worker/render/texture/attribute_table.h"
#include "worker/render/texture/texture.h"

#include <string.h>

struct mesh_attribute {
	const float *value;
	const uint32_t (*index)[3]; /* NULL: one value per triangle */
	size_t channels;
	double scale, max;
	enum color_role role;
	enum color_kind color_kind;
	bool uses_mean; /* of the components */
};

static int refuse_role(const struct scene_node *n, enum color_role role, struct error *e)
{
	const char *what = role == COLOR_HEIGHT ? "displace a surface" : "be a bump or normal map";
	return node_error(n, e, ENOTSUP, "an attribute of a mesh cannot %s", what);
}

static void find_bounds(struct mesh_attribute *m, const struct attribute_values *v)
{
	bool grey = v->is_grey || m->uses_mean;
	double ends[2] = {m->scale * (double)v->min, m->scale * (double)v->max};
	double max_value = fmax(fmax(ends[0], ends[1]), 0);
	if (m->role == COLOR_ILLUMINANT) {
		m->color_kind = v->is_grey ? COLOR_KIND_D65 : COLOR_KIND_OTHER;
		m->max = max_value * color_max_d65();
		return;
	}
	m->color_kind = grey ? COLOR_KIND_CONSTANT : COLOR_KIND_OTHER;
	if (m->role == COLOR_UNBOUNDED) {
		m->max = grey ? max_value : COLOR_UNBOUNDED_SCALE * max_value;
		return;
	}
	/* An upsampled colour may exceed its RGB components. */
	m->max = grey ? fmin(max_value, 1) : 1;
}

static int make_attribute(struct texture *t, const struct scene_node *n, const char *name, enum color_role role,
			  const struct texture_build *build, struct error *e)
{
	struct attribute_table *table = build->attributes;
	if (color_role_is_number(role))
		return refuse_role(n, role, e);
	if (!table)
		return node_error(n, e, EINVAL, "attributes are only available on a mesh");
	const struct attribute *a = attribute_find(table, name, ATTRIBUTE_COLOR, n, e);
	if (!a)
		return -EINVAL;
	bool decode = a->is_srgb && strcmp(n->type, "vertexcolors") == 0;
	const struct attribute_values *v = attribute_values_intern(table, a, decode, build->arena);
	struct mesh_attribute *m = t->data;
	if (!v)
		return node_error(n, e, ENOMEM, "out of memory");
	*m = (struct mesh_attribute){.value = v->value,
				     .index = a->is_per_face ? NULL : table->index,
				     .channels = v->channels,
				     .scale = node_float(n, "scale", 1),
				     .role = role,
				     .uses_mean = build->is_number && v->channels > 1};
	find_bounds(m, v);
	double max_value = v->is_grey || m->uses_mean ? m->max : m->max / COLOR_UNBOUNDED_SCALE;
	if (role == COLOR_UNBOUNDED && !(max_value <= PARAM_METAL_MAX))
		return node_error(n, e, ERANGE, "the attribute has numbers up to %g: they must be within [0, %g]",
				  max_value, PARAM_METAL_MAX);
	return 0;
}

static int attribute_create(struct texture *t, const struct scene_node *n, enum color_role role,
			    const struct texture_build *build, struct error *e)
{
	const char *name = node_string(n, "name", "");
	if (strncmp(name, "vertex_", 7) != 0 && strncmp(name, "face_", 5) != 0)
		return node_error(n, e, EINVAL, "needs a name that begins with `vertex_` or `face_`");
	return make_attribute(t, n, name, role, build, e);
}

static int vertexcolors_create(struct texture *t, const struct scene_node *n, enum color_role role,
			       const struct texture_build *build, struct error *e)
{
	return make_attribute(t, n, "vertex_color", role, build, e);
}

static void eval_rgb(const struct mesh_attribute *m, const struct texture_point *point, double rgb[3])
{
	size_t step = m->channels > 1, n = m->channels;
	if (!m->index) {
		const float *p = m->value + point->prim * n;
		for (size_t k = 0; k < 3; k++)
			rgb[k] = m->scale * (double)p[k * step];
		return;
	}
	for (size_t k = 0; k < 3; k++)
		rgb[k] = m->scale * texture_interpolate(m->value, n, m->index, point, k * step);
}

static spectrum mesh_attribute_eval(const struct texture *t, const struct texture_point *point,
				    const struct wavelengths *w)
{
	const struct mesh_attribute *m = t->data;
	double rgb[3], limit = m->role == COLOR_REFLECTANCE ? 1 : INFINITY;
	eval_rgb(m, point, rgb);
	for (int k = 0; k < 3; k++)
		rgb[k] = fmin(fmax(rgb[k], 0), limit);
	if (m->uses_mean)
		return spectrum_constant((rgb[0] + rgb[1] + rgb[2]) / 3);
	return m->role == COLOR_ILLUMINANT  ? color_eval_rgb_illuminant(rgb, w)
	       : m->role == COLOR_UNBOUNDED ? color_eval_rgb_unbounded(rgb, w)
					    : color_eval_rgb_reflectance(rgb, w);
}

static double mesh_attribute_max(const struct texture *t)
{
	return ((const struct mesh_attribute *)t->data)->max;
}

static enum color_kind mesh_attribute_color_kind(const struct texture *t)
{
	return ((const struct mesh_attribute *)t->data)->color_kind;
}

/* No height and no jet: creation refuses the roles that need them. */
const struct texture_ops texture_ops_mesh_attribute = {
	.decl = PLUGIN(TEXTURE, "mesh_attribute", {.name = "name", .types = VALUE_STRING},
		       {.name = "scale", .types = VALUE_FLOAT | VALUE_INT, .min = -PARAM_UV_MAX, .max = PARAM_UV_MAX}),
	.data_size = sizeof(struct mesh_attribute),
	.create = attribute_create,
	.eval = mesh_attribute_eval,
	.max = mesh_attribute_max,
	.color_kind = mesh_attribute_color_kind,
};

const struct texture_ops texture_ops_vertexcolors = {
	.decl = {PLUGIN_TEXTURE, "vertexcolors", NULL, 0, PARAM_UNDERSTOOD},
	.data_size = sizeof(struct mesh_attribute),
	.create = vertexcolors_create,
	.eval = mesh_attribute_eval,
	.max = mesh_attribute_max,
	.color_kind = mesh_attribute_color_kind,
};
