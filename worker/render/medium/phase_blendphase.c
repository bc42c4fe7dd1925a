/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Two phase functions mixed by a weight, which may vary in space: 0 is the first alone, 1 the second alone.
 *
 * Creation fails unless exactly two phase functions are nested, and if the weight depends on the wavelength.
 */
#include "worker/render/medium/phase_parts.h"

static int create(struct phase *p, const struct scene_node *n, const struct volume_build *build, struct error *e)
{
	struct phase_parts *m;
	struct volume weight;
	if (!node_child(n, PLUGIN_PHASE, 1) || node_child(n, PLUGIN_PHASE, 2))
		return node_error(n, e, EINVAL, "needs exactly two phase functions inside");
	int rc = phase_parts_create(p, &m, n, build, e);
	if (!rc)
		rc = volume_from_node(&weight, n, "weight", 0.5, COLOR_REFLECTANCE, false, build, e);
	if (!rc && volume_is_colored(&weight))
		rc = node_error(n, e, ENOTSUP, "weight: is a colour; it must be the same at all wavelengths");
	if (rc)
		return rc;
	m->second_weight = weight.grid;
	m->weight[1] = volume_max(&weight);
	m->weight[0] = 1 - m->weight[1];
	return 0;
}

const struct phase_ops phase_ops_blendphase = {
	.decl = {PLUGIN_PHASE, "blendphase",
		 PARAMS({"weight", VALUE_VOLUME | VALUE_CLAMPED, PARAM_UNDERSTOOD, 0, 1, NULL}), 1u << PLUGIN_PHASE,
		 PARAM_UNDERSTOOD},
	.create = create,
	.eval = phase_parts_eval,
	.sample = phase_parts_sample,
};
