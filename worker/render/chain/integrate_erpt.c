/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Energy redistribution: the samples of bdpt, of which chains spread what is too bright (see redistribution.h). In
 * erpt4 only one sample in four has a light sub-path, and what needs one counts four times: where camera sub-paths find
 * most of the light this halves the time, and the fireflies that it makes are the chains' to spread.
 */
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

const struct integrator integrator_erpt4 = {
	.face = {.name = "erpt4",
		 .summary = "erpt with a light sub-path in one of four samples",
		 .kind = PLAN_SAMPLES,
		 .max_depth = PATH_MAX_EDGES},
	.stream = RNG_ERPT4,
	.evaluate = path_trace_both_ways,
	.light_every = 4,
	.redistributes = true,
};
