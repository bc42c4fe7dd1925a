/* SPDX-License-Identifier: Apache-2.0 */
/* The point on the emitter moves; the half vectors up to it are kept. */
#include "worker/render/mutation/strategy.h"
#include "worker/render/world/effects_text.h"

static const struct strategy strategy = {&heuristic_roughness, STRATEGY_DRAWN, 0, .moves_emitter = true};

static double default_weight(const struct render_summary *scene)
{
	return render_effect_is_on(scene, "emitter-move") && render_effect_is_on(scene, "half-vectors") ? 0.1 : 0;
}

const struct mutation_ops mutation_light = {
	.name = "light",
	.summary = "moves the point on the emitter",
	.default_weight = default_weight,
	.strategy = &strategy,
	.propose = strategy_propose,
	.log_weight = breakup_log_weight,
};
