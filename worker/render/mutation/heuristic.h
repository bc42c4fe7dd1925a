/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Heuristics for where a path is broken up (Hanika, Kaplanyan, Dachsbacher 2015, sec. 5): x_k .. x_b is traced, x_b ..
 * x_c moves by half vectors, x_c .. x_0 stays. A heuristic gives the probability of each b, and of each c given b. It
 * may depend on the whole path, because it is evaluated for the proposal as well.
 */
#ifndef WORKER_RENDER_MUTATION_HEURISTIC_H
#define WORKER_RENDER_MUTATION_HEURISTIC_H

#include "worker/render/path/full_path.h"

struct heuristic {
	/* Sets weight[0..k], not normalised; 0: never chosen. */
	void (*weigh_b)(const struct path_context *c, const struct full_path *x, double *weight);
	/* Sets weight[0..b-1] in the same way. */
	void (*weigh_c)(const struct path_context *c, const struct full_path *x, unsigned b, double *weight);
};

/* Chooses by roughness, as in the paper. A specular vertex is never x_b or x_c. */
extern const struct heuristic heuristic_roughness;

/* Returns the probability of entry i among n weights; 0 if all are 0. */
double heuristic_probability(const double *weight, unsigned n, unsigned i);
/* Returns the entry that u in [0,1) selects; n if all weights are 0. */
unsigned heuristic_choose(const double *weight, unsigned n, double u);

#endif
