/* SPDX-License-Identifier: Apache-2.0 */
/* The strategies that propose mutations, by name, and the mixtures of them that plans hold. Any thread. */
#ifndef WORKER_RENDER_MUTATIONS_H
#define WORKER_RENDER_MUTATIONS_H

#include "common/base/error.h"
#include "common/plan/plan.h"
#include "worker/render/world/summary.h"

/* All strategies: a name and what it moves; ends with NULL. */
const char *render_mutation_at(size_t index, const char **summary);

/* The mixture of strategies of an integrator that has_mutations, as stored in a plan: "independent=0.1,hslt=0.9".
 * text: NAME or NAME=WEIGHT, separated by commas; NULL or "": the default for the scene. A canonical text does not
 * change. -EINVAL with a sentence. */
int render_mutations(const char *text, const struct render_summary *summary, char canonical[PLAN_MUTATIONS_MAX],
		     struct error *e);

#endif
