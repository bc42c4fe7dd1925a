/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What chains of full paths have in common, whatever their target function: their start, a path with its accumulated
 * weight, and the copy of the path that the next proposal changes. One thread; nothing allocates.
 */
#ifndef WORKER_RENDER_CHAIN_PATH_STATE_H
#define WORKER_RENDER_CHAIN_PATH_STATE_H

#include "worker/render/mutation/mutation.h"
#include "worker/render/path/path.h"

/* A state with the weight that it has accumulated since it was last splatted. */
struct path_state {
	struct full_path path; /* 0 edges: the chain is black and looks for light */
	double weight;
};

void path_state_copy(struct full_path *to, const struct full_path *from);
/* Makes the proposal's path equal to the current one again, after a step. any_may_differ: any vertex may differ. */
void path_state_sync_proposal(struct full_path *proposal, const struct full_path *current,
			      const struct proposal_move *move, bool any_may_differ);
/* Whether a weight with this logarithm may go to the film: it must not be NaN or infinite and, if bounded, must be
 * within the range of a float. Other weights are counted. */
bool path_state_weight_is_valid(const struct path_context *c, double log_weight, bool bounded);

/* Evaluates a bootstrap sample as bdpt does, with roulette, which chains do not use. Without it, a sample of a scene
 * whose paths may have 128 edges would cost 128 x 128 connections. */
void path_evaluate_bootstrap(struct path_context *c, struct sampler *s, struct path_sample *out);

/* Chooses one of the paths that bdpt makes of a bootstrap sample, in proportion to its contribution there: drawing
 * samples in proportion to their sums and then a path in this way gives paths in proportion to f. Returns false if the
 * sample is black. 0 edges: the path was lost to rounding. */
bool path_choose_seed(struct path_context *c, uint64_t seed, uint64_t bootstrap_index, struct full_path *x);

#endif
