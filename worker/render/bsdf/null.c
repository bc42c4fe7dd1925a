/* SPDX-License-Identifier: Apache-2.0 */
/* Light passes straight through. */
#include "worker/render/bsdf/straight.h"

static int null_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	b->passes = true;
	return straight_create(b, n, build, 1, e);
}

static const struct param null_params[] = {
	{.name = NULL},
};

STRAIGHT_OPS(null);
