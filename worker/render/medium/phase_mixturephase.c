/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Any number of phase functions with fixed weights. If the weights add up to less than 1, the rest of the light is
 * absorbed; if to more, they are scaled to add up to 1.
 *
 * Creation fails unless there is one weight for each phase function, and if a weight is negative or all are 0.
 */
#include "worker/render/medium/phase_parts.h"
#include "worker/render/text/number.h"

#include <float.h>

static int create(struct phase *p, const struct scene_node *n, const struct volume_build *build, struct error *e)
{
	struct phase_parts *m;
	int rc = phase_parts_create(p, &m, n, build, e);
	if (rc)
		return rc;
	const char *text = node_string(n, "weights", "");
	double sum = 0;
	if (number_parse_weights(text, m->weight, PHASE_PARTS_MAX) != (int)m->count)
		return node_error(n, e, EINVAL, "weights=\"%s\": needs %u weight%s, one for each phase function", text,
				  m->count, m->count == 1 ? "" : "s");
	for (uint32_t k = 0; k < m->count; k++) {
		if (!(m->weight[k] >= 0 && m->weight[k] <= 1e6))
			return node_error(n, e, ERANGE, "weights=\"%s\": must be within [0, 1e6]", text);
		sum += m->weight[k];
	}
	if (!(sum > 0))
		return node_error(n, e, EINVAL, "weights=\"%s\": all are 0", text);
	for (uint32_t k = 0; k < m->count; k++)
		m->weight[k] /= sum;
	/* Not if only rounding errors are missing. */
	p->absorbed_share = 1 - sum > m->count * DBL_EPSILON ? 1 - sum : 0;
	return 0;
}

const struct phase_ops phase_ops_mixturephase = {
	.decl = {PLUGIN_PHASE, "mixturephase", PARAMS({"weights", UNDERSTOOD(VALUE_STRING)}), 1u << PLUGIN_PHASE,
		 PARAM_UNDERSTOOD},
	.create = create,
	.eval = phase_parts_eval,
	.sample = phase_parts_sample,
};
