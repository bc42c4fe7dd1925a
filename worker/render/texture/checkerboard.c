/* SPDX-License-Identifier: Apache-2.0 */
/* Two textures in a 2 x 2 pattern on the unit square; color0 where both halves agree. */
#include "worker/render/texture/texture.h"
#include "worker/render/texture/uv.h"

struct checkerboard {
	struct texture color[2];
	struct uv_map map;
};

static int checkerboard_create(struct texture *t, const struct scene_node *n, enum color_role role,
			       const struct texture_build *build, struct error *e)
{
	struct checkerboard *c = arena_alloc(build->arena, 1, sizeof *c);
	if (!c)
		return node_error(n, e, ENOMEM, "out of memory");
	t->data = c;
	c->map = uv_map_read(n);
	int code = texture_from_node(&c->color[0], n, "color0", 0.4, role, build, e);
	return code ? code : texture_from_node(&c->color[1], n, "color1", 0.2, role, build, e);
}

static const struct texture *square_at(const struct checkerboard *c, double u, double v)
{
	uv_map_apply(&c->map, &u, &v);
	bool right = u - floor(u) > 0.5, low = v - floor(v) > 0.5;
	return &c->color[right != low];
}

static spectrum checkerboard_eval(const struct texture *t, const struct texture_point *at, const struct wavelengths *w)
{
	return texture_eval(square_at(t->data, at->u, at->v), at, w);
}

static double checkerboard_height(const struct texture *t, double u, double v)
{
	return texture_height(square_at(t->data, u, v), u, v);
}

/* The derivative is 0 between the edges. */
static void checkerboard_jet(const struct texture *t, double u, double v, struct texture_jet *j)
{
	texture_jet(square_at(t->data, u, v), u, v, j);
}

static double checkerboard_max(const struct texture *t)
{
	const struct checkerboard *c = t->data;
	return fmax(texture_max(&c->color[0]), texture_max(&c->color[1]));
}

static enum color_shape checkerboard_shape(const struct texture *t)
{
	const struct checkerboard *c = t->data;
	enum color_shape first = texture_shape(&c->color[0]);
	return first == texture_shape(&c->color[1]) ? first : COLOR_SHAPE_OTHER;
}

static const struct param checkerboard_params[] = {
	{.name = "color0", .types = VALUE_TEXTURE, .min = -PARAM_LENGTH_MAX, .max = PARAM_LENGTH_MAX},
	{.name = "color1", .types = VALUE_TEXTURE, .min = -PARAM_LENGTH_MAX, .max = PARAM_LENGTH_MAX},
	UV_PARAMS,
	{.name = NULL},
};

const struct texture_ops texture_ops_checkerboard = {
	.type = "checkerboard",
	.params = checkerboard_params,
	.create = checkerboard_create,
	.eval = checkerboard_eval,
	.height = checkerboard_height,
	.jet = checkerboard_jet,
	.max = checkerboard_max,
	.shape = checkerboard_shape,
};
