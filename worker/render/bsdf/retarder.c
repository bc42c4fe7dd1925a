/* SPDX-License-Identifier: Apache-2.0 */
/* A linear retarder, for light without polarization: all of it passes straight through. */
#include "worker/render/bsdf/straight.h"

static int retarder_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	return straight_create(b, n, build, 1, e);
}

static const struct param retarder_params[] = {
	{.name = "theta", .status = PARAM_IGNORED},
	{.name = "delta", .status = PARAM_IGNORED},
	{.name = NULL},
};

STRAIGHT_OPS(retarder);
