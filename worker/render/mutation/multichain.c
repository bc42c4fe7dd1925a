/* SPDX-License-Identifier: Apache-2.0 */
/* The whole path is traced by perturbed half vectors (Hanika, Kaplanyan, Dachsbacher 2015, sec. 4). */
#include "worker/render/mutation/strategy.h"

static const struct strategy strategy = {&heuristic_roughness, 0, 0, .wavelength = true, .aperture = true};

static enum proposal_end propose(struct mutation_ctx *m, const struct mutation_setting *how, struct full_path *x,
				 struct full_path *y, struct move *move)
{
	return strategy_propose(&strategy, m, how, x, y, move);
}

static double useful(const struct render_summary *scene)
{
	(void)scene;
	return 0; /* the breakup does this where it helps */
}

const struct mutation_ops mutation_multichain = {
	.name = "multichain",
	.summary = "traced from the camera by perturbed half vectors",
	.useful = useful,
	.propose = propose,
	.log_weight = breakup_log_weight,
};
