/* SPDX-License-Identifier: Apache-2.0 */
/* The whole path is traced with perturbed half vectors (Hanika, Kaplanyan, Dachsbacher 2015, sec. 4). `hslt` includes
 * this move where it helps. */
#include "worker/render/mutation/strategy.h"

static const struct strategy strategy = {&heuristic_roughness, 0, 0, .moves_wavelength = true, .moves_aperture = true};

const struct mutation_ops mutation_multichain = {
	.name = "multichain",
	.summary = "traced from the camera by perturbed half vectors",
	.strategy = &strategy,
	.propose = strategy_propose,
	.log_weight = breakup_log_weight,
};
