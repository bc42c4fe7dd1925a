/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Points at which paths from the camera scatter, and how much of its direct light each gets from which part of
 * the emitters (emitter_part.h): what emitter_choice.h learns from.
 */
#ifndef WORKER_RENDER_WORLD_EMITTER_POINTS_H
#define WORKER_RENDER_WORLD_EMITTER_POINTS_H

#include "worker/render/math/point_tree.h"
#include "worker/render/world/world.h"

struct emitter_points {
	uint32_t count;
	struct point_tree_node *nodes; /* positions; id: the row of `share` */
	float *share;		       /* [count][emitter_part_count], the sum of each row is 1 */
};

/* Points of a finished world with at least one emitter, at most `most` of them; those that get no light are left out.
 * Memory comes from the arena. Deterministic. -ENOMEM: no memory. */
int emitter_points_find(const struct world *w, uint32_t most, struct arena *arena, struct emitter_points *out);

#endif
