/* SPDX-License-Identifier: Apache-2.0 */
/* Improved half vector space light transport: the breakup by roughness (Hanika, Kaplanyan, Dachsbacher 2015, sec. 5).
 */
#include "worker/render/mutation/strategy.h"
#include "worker/render/world/effects_text.h"

static const struct strategy strategy = {&heuristic_roughness, STRATEGY_DRAWN,	   STRATEGY_DRAWN,
					 .halfvecs = true,     .wavelength = true, .aperture = true};

static double useful(const struct render_summary *scene)
{
	return render_effect_on(scene, "half-vectors") ? 0.8 : 0;
}

const struct mutation_ops mutation_hslt = {
	.name = "hslt",
	.summary = "traced to x_b, half vectors to x_c, both drawn by roughness",
	.useful = useful,
	.strategy = &strategy,
};

/* The following do what the breakup does where that helps: default mixtures are without them. */

/* All half vectors of a path move, its two ends stay (Kaplanyan, Hanika, Dachsbacher 2014). */
static const struct strategy all_halfvecs = {&heuristic_roughness, STRATEGY_CAMERA, 0, .halfvecs = true,
					     .wavelength = true};

const struct mutation_ops mutation_halfvec = {
	.name = "halfvec",
	.summary = "all half vectors between camera and emitter",
	.strategy = &all_halfvecs,
};

/* The whole path is traced by perturbed half vectors (Hanika, Kaplanyan, Dachsbacher 2015, sec. 4). */
static const struct strategy traced = {&heuristic_roughness, 0, 0, .wavelength = true, .aperture = true};

const struct mutation_ops mutation_multichain = {
	.name = "multichain",
	.summary = "traced from the camera by perturbed half vectors",
	.strategy = &traced,
};
