/* SPDX-License-Identifier: Apache-2.0 */
/* Any number of BSDFs with fixed weights. If the weights add up to less than 1, the rest of the light is absorbed; if
 * to more, they are scaled to add up to 1. */
#include "worker/render/bsdf/blend.h"
#include "worker/render/text/number.h"

/* Reads one weight for each part. */
static int read_weights(struct blend *m, const struct scene_node *n, struct error *e)
{
	const char *text = node_string(n, "weights", "");
	double sum = 0;
	if (number_parse_weights(text, m->fixed_weight, BLEND_PARTS_MAX) != (int)m->count)
		return node_error(n, e, EINVAL, "weights=\"%s\": needs %u weight%s, one for each BSDF", text, m->count,
				  m->count == 1 ? "" : "s");
	for (uint32_t k = 0; k < m->count; k++) {
		if (!(m->fixed_weight[k] >= 0 && m->fixed_weight[k] <= 1e6))
			return node_error(n, e, ERANGE, "weights=\"%s\": must be within [0, 1e6]", text);
		sum += m->fixed_weight[k];
	}
	if (!(sum > 0))
		return node_error(n, e, EINVAL, "weights=\"%s\": all are 0", text);
	for (uint32_t k = 0; k < m->count && sum > 1; k++)
		m->fixed_weight[k] /= sum;
	return bsdf_check_energy(n, sum, e);
}

static int mixturebsdf_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build,
			      struct error *e)
{
	uint32_t count = 0;
	while (node_child(n, PLUGIN_BSDF, count))
		if (count++ == BLEND_PARTS_MAX)
			return node_error(n, e, ERANGE, "more than %d BSDFs inside", BLEND_PARTS_MAX);
	if (count == 0)
		return node_error(n, e, EINVAL, "needs BSDFs inside");
	struct blend *m = blend_begin(b, count);
	m->has_fixed_weights = true;
	int code = read_weights(m, n, e);
	if (!code)
		code = blend_read_parts(m, b, n, build, e);
	double sum = 0;
	for (uint32_t k = 0; k < m->count && !code; k++)
		sum += m->fixed_weight[k];
	b->mean_alpha = 0;
	for (uint32_t k = 0; k < m->count && !code; k++)
		b->mean_alpha += m->fixed_weight[k] / sum * m->part[k].mean_alpha;
	return code;
}

BLEND_OPS(mixturebsdf, {.name = "weights", .types = VALUE_STRING}, BSDF_ENERGY_PARAM);
