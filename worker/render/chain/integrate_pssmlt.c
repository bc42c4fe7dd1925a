/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Primary sample space Metropolis light transport (Kelemen et al. 2002), over the bidirectional path tracer.
 */
#include "worker/render/chain/pss.h"
#include "worker/render/chain/pss_chain.h"
#include "worker/render/path/integrate_bdpt.h"
#include "worker/render/path/integrator.h"

const struct integrator integrator_pssmlt = {
	.face = {.name = "pssmlt",
		 .summary = "primary sample space Metropolis over bdpt",
		 .kind = PLAN_CHAINS,
		 .max_depth = PSS_MAX_EDGES},
	.stream = RNG_BOOTSTRAP,
	.evaluate = path_trace_both_ways,
	.chain = &chain_pss,
};
