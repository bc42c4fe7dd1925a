/* SPDX-License-Identifier: Apache-2.0 */
/* Two textures in a 2 x 2 pattern on the unit square; color0 where both halves agree. */
#include "worker/render/texture/pattern.h"

static unsigned square_at(const struct pattern *p, double u, double v)
{
	(void)p;
	bool right = u - floor(u) > 0.5, low = v - floor(v) > 0.5;
	return right != low;
}

static int checkerboard_create(struct texture *t, const struct scene_node *n, enum color_role role,
			       const struct texture_build *build, struct error *e)
{
	((struct pattern *)t->data)->which = square_at;
	return pattern_create(t, n, (const double[2]){0.4, 0.2}, role, build, e);
}

static const struct param checkerboard_params[] = {PATTERN_PARAMS, {.name = NULL}};

PATTERN_OPS(checkerboard);
