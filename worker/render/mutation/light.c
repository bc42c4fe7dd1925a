/* SPDX-License-Identifier: Apache-2.0 */
/* The point on the emitter moves; half vectors up to it stay the same. */
#include "worker/render/mutation/strategy.h"
#include "worker/render/world/effects_text.h"

static const struct strategy strategy = {&heuristic_roughness, STRATEGY_DRAWN, 0, .emitter = true};

static enum proposal_end propose(struct mutation_ctx *m, const struct mutation_setting *how, struct full_path *x,
				 struct full_path *y, struct move *move)
{
	return strategy_propose(&strategy, m, how, x, y, move);
}

static double useful(const struct render_summary *scene)
{
	return render_effect_on(scene, "emitter-move") && render_effect_on(scene, "half-vectors") ? 0.1 : 0;
}

const struct mutation_ops mutation_light = {
	.name = "light",
	.summary = "moves the point on the emitter",
	.useful = useful,
	.propose = propose,
	.log_weight = breakup_log_weight,
};
