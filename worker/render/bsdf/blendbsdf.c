/* SPDX-License-Identifier: Apache-2.0 */
/* Two BSDFs mixed by a weight: 0 is the first BSDF alone, 1 the second alone. */
#include "worker/render/bsdf/blend.h"

static int blendbsdf_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	if (!node_child(n, PLUGIN_BSDF, 1) || node_child(n, PLUGIN_BSDF, 2))
		return node_error(n, e, EINVAL, "needs exactly two BSDFs inside");
	struct blend *m = blend_begin(b, 2);
	int code = blend_read_parts(m, b, n, build, e);
	if (code)
		return code;
	b->mean_alpha = 0.5 * m->part[0].mean_alpha + 0.5 * m->part[1].mean_alpha;
	return bsdf_read_number(b, &m->weight, n, "weight", 0.5, build, e);
}

BLEND_OPS(blendbsdf, {.name = "weight", .types = VALUE_TEXTURE | VALUE_CLAMPED, .min = 0, .max = 1});
