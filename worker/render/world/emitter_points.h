/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Finds points at which camera paths scatter, and which share of the direct light at each point comes from each part of
 * the emitters (emitter_part.h). emitter_choice.h learns from them.
 */
#ifndef WORKER_RENDER_WORLD_EMITTER_POINTS_H
#define WORKER_RENDER_WORLD_EMITTER_POINTS_H

#include "worker/render/math/point_tree.h"
#include "worker/render/world/world.h"

struct emitter_points {
	uint32_t count;
	struct point_tree_node *nodes; /* positions; id is the row of `shares` */
	float *shares;		       /* [count][emitter_part_count]; each row sums to 1 */
};

/* Finds points of a finished world with at least one emitter, at most `max_points` of them; points that get no light
 * are left out. Memory comes from the arena. Deterministic. Returns -ENOMEM if out of memory. */
int emitter_points_find(const struct world *w, uint32_t max_points, struct arena *arena, struct emitter_points *out);

#endif
