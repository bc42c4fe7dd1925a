/* SPDX-License-Identifier: Apache-2.0 */
/* Energy redistribution: the samples of bdpt, of which chains spread what is too bright (see redistribution.h). */
#include "worker/render/path/integrate_bdpt.h"
#include "worker/render/path/integrator.h"

const struct integrator integrator_erpt = {
	.face = {.name = "erpt",
		 .summary = "bdpt, whose brightest contributions are spread by short chains of mutations",
		 .kind = PLAN_SAMPLES,
		 .max_depth = PATH_MAX_EDGES},
	.stream = RNG_ERPT,
	.evaluate = path_trace_both_ways,
	.redistributes = true,
};
