/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/texture/pattern.h"

int pattern_create(struct texture *t, const struct scene_node *n, const double defaults[2], enum color_role role,
		   const struct texture_build *build, struct error *e)
{
	struct pattern *p = t->data;
	p->map = uv_map_read(n);
	int code = texture_from_node(&p->color[0], n, "color0", defaults[0], role, build, e);
	return code ? code : texture_from_node(&p->color[1], n, "color1", defaults[1], role, build, e);
}

static const struct texture *texture_at(const struct pattern *p, double u, double v)
{
	uv_map_apply(&p->map, &u, &v);
	return &p->color[p->which(p, u, v)];
}

spectrum pattern_eval(const struct texture *t, const struct texture_point *at, const struct wavelengths *w)
{
	return texture_eval(texture_at(t->data, at->u, at->v), at, w);
}

double pattern_height(const struct texture *t, double u, double v)
{
	return texture_height(texture_at(t->data, u, v), u, v);
}

/* The derivative is 0 between the edges. */
void pattern_jet(const struct texture *t, double u, double v, struct texture_jet *j)
{
	texture_jet(texture_at(t->data, u, v), u, v, j);
}

double pattern_max(const struct texture *t)
{
	const struct pattern *p = t->data;
	return fmax(texture_max(&p->color[0]), texture_max(&p->color[1]));
}

enum color_shape pattern_shape(const struct texture *t)
{
	const struct pattern *p = t->data;
	enum color_shape first = texture_shape(&p->color[0]);
	return first == texture_shape(&p->color[1]) ? first : COLOR_SHAPE_OTHER;
}
