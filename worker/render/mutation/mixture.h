/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Which strategies a chain uses, and how often: "independent=0.1,hslt=0.9", as in a plan. Forced choices for tests:
 * "hslt@b3c1". Pure.
 */
#ifndef WORKER_RENDER_MUTATION_MIXTURE_H
#define WORKER_RENDER_MUTATION_MIXTURE_H

#include "worker/render/mutation/mutation.h"

struct mixture_entry {
	const struct mutation_ops *ops;
	struct mutation_setting how;
	double weight;
};

struct mixture {
	unsigned count, independent; /* index of the entry that makes independent proposals */
	double total;
	struct mixture_entry entry[BATCH_STRATEGIES];
};

/* Adds independent proposals if the list has none. -EINVAL with a sentence: an unknown strategy, a weight that is
 * not above 0, too many entries. */
int mixture_parse(const char *text, struct mixture *out, struct error *e);
/* As text; parsing and printing it again does not change it. */
void mixture_print(const struct mixture *m, char text[PLAN_MUTATIONS_MAX]);
/* The default for this scene. */
void mixture_default(const struct render_summary *scene, struct mixture *out);
/* The entry that u in [0,1) selects. */
unsigned mixture_choose(const struct mixture *m, double u);

#endif
