/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Improved half vector space light transport (Hanika, Kaplanyan, Dachsbacher 2015): chains of whole paths. Their
 * bootstrap is that of bdpt.
 */
#include "worker/render/chain/path_chain.h"
#include "worker/render/path/full_path.h"
#include "worker/render/path/integrate_bdpt.h"
#include "worker/render/path/integrator.h"

const struct integrator integrator_hslt = {
	.face = {"hslt", "improved half vector space light transport", PLAN_CHAINS, FULL_PATH_MAX_EDGES,
		 .has_mutations = true},
	.stream = RNG_BOOTSTRAP,
	.evaluate = path_trace_both_ways,
	.chain = &chain_path,
};
