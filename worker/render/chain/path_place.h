/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What chains of full paths have in common, whatever their target: a path with the weight that it has gathered, and the
 * copy of it that the next proposal changes. One thread; nothing allocates.
 */
#ifndef WORKER_RENDER_CHAIN_PATH_PLACE_H
#define WORKER_RENDER_CHAIN_PATH_PLACE_H

#include "worker/render/mutation/mutation.h"

/* A state with what it has gathered and not splatted yet. */
struct path_place {
	struct full_path_path path; /* 0 edges: black, looking for light */
	double weight;
};

void path_place_copy(struct full_path_path *to, const struct full_path_path *from);
/* After a step: the proposal's path equals the current one again. all: any vertex may differ. */
void path_place_follow(struct full_path_path *proposal, const struct full_path_path *current, const struct move *move,
		       bool all);
/* The logarithm of a weight that the film may have; what is not is counted, and is no proposal. What is bounded has to
 * be within a float. */
bool path_place_is_sound(const struct path_context *c, double log_weight, bool bounded);

#endif
