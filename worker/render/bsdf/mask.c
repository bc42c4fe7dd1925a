/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A BSDF with holes: it scatters the share `opacity` of the light, and lets the rest pass straight through. The latter
 * is a specular lobe and counts as an edge of the path. Connections look through it (path/transparent.h).
 */
#include "worker/render/bsdf/blend.h"
#include "worker/render/bsdf/twosided.h"

extern const struct bsdf_ops bsdf_ops_null;

static int mask_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	const struct scene_node *inner = node_child(n, PLUGIN_BSDF, 0);
	if (!inner || node_child(n, PLUGIN_BSDF, 1))
		return node_error(n, e, EINVAL, "needs exactly one BSDF inside");
	struct blend *m = blend_begin(b, 2);
	m->is_weight_of_first = true;
	int code = bsdf_create(&m->part[0], inner, build, e);
	if (!code)
		code = bsdf_mirror_back(&m->part[0], build, e);
	if (!code)
		code = bsdf_create_as(&m->part[1], &bsdf_ops_null, n, build, e); /* n has no `transmittance` */
	if (!code)
		code = blend_merge_part(b, &m->part[0], inner->type, n, e);
	if (!code)
		code = blend_merge_part(b, &m->part[1], "null", n, e);
	if (!code)
		code = (build->is_dialect_3 ? bsdf_read_number : bsdf_read_texture)(b, &m->weight, n, "opacity", 0.5,
										    build, e);
	if (code)
		return code;
	b->relief = m->part[0].relief;
	b->uses_relief_frames = m->part[0].uses_relief_frames;
	b->is_see_through = true;
	b->mean_alpha = m->part[0].mean_alpha;
	if (!b->has_smooth)
		b->min_alpha = 0;
	return 0;
}

BLEND_OPS(mask, {.name = "opacity", .types = VALUE_TEXTURE | VALUE_CLAMPED, .min = 0, .max = 1});
