/* SPDX-License-Identifier: Apache-2.0 */
/* The mutation strategies by name, and the mixtures of them that plans contain. Any thread. */
#ifndef WORKER_RENDER_MUTATIONS_H
#define WORKER_RENDER_MUTATIONS_H

#include "common/base/error.h"
#include "common/plan/plan.h"
#include "worker/render/world/summary.h"

/* Returns the name of a strategy, and what it moves in *summary; NULL at the end. */
const char *render_mutation_at(size_t index, const char **summary);

/* Writes the mixture of an integrator with has_mutations as stored in a plan: "independent=0.1,hslt=0.9". text: NAME or
 * NAME=WEIGHT, separated by commas; NULL or "": the default for the scene. A canonical text does not change. Returns
 * -EINVAL and an error message. */
int render_canonical_mutations(const char *text, const struct render_summary *summary,
			       char canonical[PLAN_MUTATIONS_MAX], struct error *e);

#endif
