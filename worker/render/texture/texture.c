/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/texture/texture.h"

#include "common/base/color.h"
#include "worker/render/scene/value.h"

#include <string.h>

#define TEXTURE(name) extern const struct texture_ops texture_ops_##name;
#include "worker/render/texture/texture_list.h"
#undef TEXTURE

const struct texture_ops *const texture_registry[] = {
#define TEXTURE(name) &texture_ops_##name,
#include "worker/render/texture/texture_list.h"
#undef TEXTURE
	NULL,
};

int texture_create(struct texture *t, const struct scene_node *n, enum color_role role,
		   const struct texture_build *build, struct error *e)
{
	for (const struct texture_ops *const *ops = texture_registry; *ops; ops++)
		if (n->cls == PLUGIN_TEXTURE && strcmp((*ops)->decl.type, n->type) == 0) {
			*t = (struct texture){.ops = *ops, .data = arena_alloc(build->arena, 1, (*ops)->data_size)};
			if (!t->data)
				return node_error(n, e, ENOMEM, "out of memory");
			return (*ops)->create(t, n, role, build, e);
		}
	return node_error(n, e, ENOTSUP, "\"%s\" is not a supported texture", n->type);
}

/* Reads a constant for COLOR_HEIGHT or COLOR_RELIEF. The height of a colour is its luminance, as in a coloured
 * image. */
static int height_from_value(struct texture *t, const struct scene_node *n, const char *name, const struct value *v,
			     struct error *e)
{
	double scratch[3];
	uint32_t count;
	const double *x = value_numbers(v, scratch, &count);
	if (v->type == VALUE_SPECTRUM)
		return node_error(n, e, EINVAL, "%s: a height or a normal is a number or an RGB colour, not a spectrum",
				  name);
	double height = count == 3 ? rec709_luminance(x) : x[0];
	if (!isfinite(height))
		return node_error(n, e, EINVAL, "%s: a height must be finite", name);
	t->color = color_constant(height);
	for (int k = 0; k < 3; k++)
		t->relief[k] = x[count == 3 ? k : 0];
	return 0;
}

/* A colour where a number is expected, as Mitsuba 3 takes it: the mean of r, g and b, or over a table's wavelengths. */
static double mean_of_color(const struct value *v)
{
	const double *nm = v->as.spectrum.nm, *x = v->as.spectrum.value;
	double sum = 0;
	if (v->type == VALUE_RGB)
		return (v->as.rgb[0] + v->as.rgb[1] + v->as.rgb[2]) / 3;
	for (uint32_t i = 1; i < v->as.spectrum.count; i++)
		sum += (nm[i] - nm[i - 1]) * 0.5 * (x[i - 1] + x[i]);
	return sum / (nm[v->as.spectrum.count - 1] - nm[0]);
}

int texture_from_node(struct texture *t, const struct scene_node *n, const char *name, double fallback,
		      enum color_role role, const struct texture_build *build, struct error *e)
{
	const struct value absent = {.type = VALUE_FLOAT, .as.number = fallback};
	const struct property *p = node_find_property(n, name);
	const struct value *v = p ? &p->value : &absent;
	*t = (struct texture){.ops = NULL};
	if (v->type == VALUE_NODE)
		return texture_create(t, v->as.node, role, build, e);
	if (color_role_is_number(role))
		return height_from_value(t, n, name, v, e);
	struct error reason;
	int code = color_from_value(v, role, build->arena, &t->color, &reason);
	if (code)
		return node_error(n, e, -code, "%s: %s", name, reason.text);
	if (build->is_number && t->color.kind != COLOR_KIND_CONSTANT)
		t->color = color_constant(mean_of_color(v));
	return 0;
}

double texture_aspect(const struct texture *t)
{
	return t->ops && t->ops->aspect ? t->ops->aspect(t) : 1;
}

double texture_max(const struct texture *t)
{
	return t->ops ? t->ops->max(t) : color_max(&t->color);
}

enum color_kind texture_color_kind(const struct texture *t)
{
	return t->ops ? t->ops->color_kind(t) : t->color.kind;
}
