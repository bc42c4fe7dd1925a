/* SPDX-License-Identifier: Apache-2.0 */
/* All half vectors of a path move, its two ends stay (Kaplanyan, Hanika, Dachsbacher 2014). */
#include "worker/render/mutation/strategy.h"

static const struct strategy strategy = {&heuristic_roughness, STRATEGY_CAMERA, 0, .halfvecs = true,
					 .wavelength = true};

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

const struct mutation_ops mutation_halfvec = {
	.name = "halfvec",
	.summary = "all half vectors between camera and emitter",
	.useful = useful,
	.propose = propose,
	.log_weight = breakup_log_weight,
};
