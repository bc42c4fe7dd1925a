/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Textures that choose one of two others, depending on (u,v).
 *
 * `checkerboard`: a 2 x 2 pattern on the unit square, with color0 in the squares on the main diagonal and color1 in the
 * others. In Mitsuba 3 the two are exchanged if the pattern stands for numbers (roughness, opacity, weights).
 * `gridtexture` (0.5/0.6): lines of color1 on color0, along the edges of the unit squares. A line is twice line_width
 * wide, as in Mitsuba.
 */
#include "worker/render/texture/texture.h"
#include "worker/render/texture/uv.h"

struct pattern {
	struct texture color[2];
	struct uv_map map;
	unsigned (*choose)(const struct pattern *p, double u, double v); /* index of the texture; (u,v) are mapped */
	double line_width;
};

static unsigned choose_square(const struct pattern *p, double u, double v)
{
	(void)p;
	bool right = u - floor(u) > 0.5, low = v - floor(v) > 0.5;
	return right != low;
}

/* Returns the distance to the nearest integer. */
static double distance_to_integer(double x)
{
	return fabs(x - round(x));
}

static unsigned choose_line(const struct pattern *p, double u, double v)
{
	return distance_to_integer(u) < p->line_width || distance_to_integer(v) < p->line_width;
}

/* defaults: of color0 and color1; is_exchanged: each takes the place of the other. */
static int create_pattern(struct texture *t, const struct scene_node *n, const double defaults[2], bool is_exchanged,
			  enum color_role role, const struct texture_build *build, struct error *e)
{
	struct pattern *p = t->data;
	p->map = uv_map_read(n);
	int first = is_exchanged ? 1 : 0;
	int code = texture_from_node(&p->color[first], n, "color0", defaults[0], role, build, e);
	return code ? code : texture_from_node(&p->color[1 - first], n, "color1", defaults[1], role, build, e);
}

static int checkerboard_create(struct texture *t, const struct scene_node *n, enum color_role role,
			       const struct texture_build *build, struct error *e)
{
	((struct pattern *)t->data)->choose = choose_square;
	return create_pattern(t, n, (const double[2]){0.4, 0.2}, build->is_number && build->is_dialect_3, role, build,
			      e);
}

static int gridtexture_create(struct texture *t, const struct scene_node *n, enum color_role role,
			      const struct texture_build *build, struct error *e)
{
	struct pattern *p = t->data;
	p->choose = choose_line;
	p->line_width = node_float(n, "line_width", 0.01);
	return create_pattern(t, n, (const double[2]){0.2, 0.4}, false, role, build, e);
}

static const struct texture *texture_at(const struct pattern *p, double u, double v)
{
	uv_map_apply(&p->map, &u, &v);
	return &p->color[p->choose(p, u, v)];
}

static spectrum pattern_eval(const struct texture *t, const struct texture_point *point, const struct wavelengths *w)
{
	return texture_eval(texture_at(t->data, point->u, point->v), point, w);
}

static double pattern_height(const struct texture *t, double u, double v)
{
	return texture_height(texture_at(t->data, u, v), u, v);
}

/* Edges between the two textures have no effect on the derivatives. */
static void pattern_eval_derivatives(const struct texture *t, double u, double v, struct texture_derivatives *j)
{
	texture_eval_derivatives(texture_at(t->data, u, v), u, v, j);
}

static double pattern_max(const struct texture *t)
{
	const struct pattern *p = t->data;
	return fmax(texture_max(&p->color[0]), texture_max(&p->color[1]));
}

static enum color_kind pattern_color_kind(const struct texture *t)
{
	const struct pattern *p = t->data;
	enum color_kind first = texture_color_kind(&p->color[0]);
	return first == texture_color_kind(&p->color[1]) ? first : COLOR_KIND_OTHER;
}

#define COLORS                                                                                                 \
	{.name = "color0", .types = VALUE_TEXTURE, .min = -PARAM_LENGTH_MAX, .max = PARAM_LENGTH_MAX},         \
		{.name = "color1", .types = VALUE_TEXTURE, .min = -PARAM_LENGTH_MAX, .max = PARAM_LENGTH_MAX}, \
		UV_PARAMS
#define PATTERN_OPS(NAME, ...)                                                             \
	const struct texture_ops texture_ops_##NAME = {                                    \
		.decl = {PLUGIN_TEXTURE, #NAME, PARAMS(__VA_ARGS__), 0, PARAM_UNDERSTOOD}, \
		.data_size = sizeof(struct pattern),                                       \
		.create = NAME##_create,                                                   \
		.eval = pattern_eval,                                                      \
		.height = pattern_height,                                                  \
		.eval_derivatives = pattern_eval_derivatives,                              \
		.max = pattern_max,                                                        \
		.color_kind = pattern_color_kind,                                          \
	}
PATTERN_OPS(checkerboard, COLORS);
PATTERN_OPS(gridtexture, COLORS, {.name = "line_width", .types = VALUE_FLOAT | VALUE_INT, .min = 0, .max = 1});
