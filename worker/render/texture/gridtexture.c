/* SPDX-License-Identifier: Apache-2.0 */
/* Lines of color1 on color0, along the edges of the unit squares: 0.5/0.6. A line is twice line_width wide, as in
 * Mitsuba. */
#include "worker/render/texture/pattern.h"

/* Of the nearest whole number. */
static double distance(double x)
{
	return fabs(x - round(x));
}

static unsigned line_at(const struct pattern *p, double u, double v)
{
	return distance(u) < p->line_width || distance(v) < p->line_width;
}

static int gridtexture_create(struct texture *t, const struct scene_node *n, enum color_role role,
			      const struct texture_build *build, struct error *e)
{
	struct pattern *p = t->data;
	p->which = line_at;
	p->line_width = node_float(n, "line_width", 0.01);
	return pattern_create(t, n, (const double[2]){0.2, 0.4}, role, build, e);
}

static const struct param gridtexture_params[] = {
	PATTERN_PARAMS,
	{.name = "line_width", .types = VALUE_FLOAT | VALUE_INT, .min = 0, .max = 1},
	{.name = NULL},
};

PATTERN_OPS(gridtexture);
