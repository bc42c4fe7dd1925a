/* SPDX-License-Identifier: Apache-2.0 */
/* Improved half vector space light transport: breakup by roughness (Hanika, Kaplanyan, Dachsbacher 2015, sec. 5). */
#include "worker/render/mutation/strategy.h"
#include "worker/render/world/effects_text.h"

static const struct strategy strategy = {&heuristic_roughness,	 STRATEGY_DRAWN,	   STRATEGY_DRAWN,
					 .moves_halfvecs = true, .moves_wavelength = true, .moves_aperture = true};

static double default_weight(const struct render_summary *scene)
{
	return render_effect_is_on(scene, "half-vectors") ? 0.8 : 0;
}

const struct mutation_ops mutation_hslt = {
	.name = "hslt",
	.summary = "traced to x_b, half vectors to x_c, both drawn by roughness",
	.default_weight = default_weight,
	.strategy = &strategy,
	.propose = strategy_propose,
	.log_weight = breakup_log_weight,
};
