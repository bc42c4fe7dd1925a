/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The mixture of strategies that a chain uses: "independent=0.1,hslt=0.9", as in a plan. Tests can force
 * choices: "hslt@b3c1". Pure.
 */
#ifndef WORKER_RENDER_MUTATION_MIXTURE_H
#define WORKER_RENDER_MUTATION_MIXTURE_H

#include "worker/render/mutation/mutation.h"

struct mixture_entry {
	const struct mutation_ops *ops;
	struct mutation_forced_choice forced;
	double weight;
};

struct mixture {
	unsigned count, independent_index; /* independent_index: of the entry that makes independent proposals */
	double total_weight;
	struct mixture_entry entries[BATCH_STRATEGIES];
};

/* Parses a mixture and adds independent proposals if it has none. Returns -EINVAL and an error message for an unknown
 * strategy, a weight that is not above 0, or too many entries. */
int mixture_parse(const char *text, struct mixture *out, struct error *e);
/* Writes a mixture as text; parsing and printing that again does not change it. */
void mixture_print(const struct mixture *m, char text[PLAN_MUTATIONS_MAX]);
/* Makes the default mixture for a scene. */
void mixture_init_default(const struct render_summary *scene, struct mixture *out);
/* Returns the entry that u in [0,1) selects. */
unsigned mixture_choose(const struct mixture *m, double u);

#endif
