/* SPDX-License-Identifier: Apache-2.0 */
/* A circular polarizer, for light without polarization: half of it passes straight through. */
#include "worker/render/bsdf/straight.h"

static int circular_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	return straight_create(b, n, build, 0.5, e);
}

static const struct param circular_params[] = {
	{.name = "transmittance", .types = VALUE_TEXTURE, .min = 0, .max = 1},
	{.name = "left_handed", .status = PARAM_IGNORED},
	{.name = NULL},
};

STRAIGHT_OPS(circular);
