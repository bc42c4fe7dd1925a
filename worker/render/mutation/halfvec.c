/* SPDX-License-Identifier: Apache-2.0 */
/* All half vectors of a path move while its two ends stay (Kaplanyan, Hanika, Dachsbacher 2014). `hslt` includes
 * this move where it helps. */
#include "worker/render/mutation/strategy.h"

static const struct strategy strategy = {&heuristic_roughness, STRATEGY_CAMERA, 0, .moves_halfvecs = true,
					 .moves_wavelength = true};

const struct mutation_ops mutation_halfvec = {
	.name = "halfvec",
	.summary = "all half vectors between camera and emitter",
	.strategy = &strategy,
	.propose = strategy_propose,
	.log_weight = breakup_log_weight,
};
