/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A tree of points in space, to find those within a distance (Bentley 1975, k-d trees). The order in which they are
 * found depends on the points only, so that sums over them have the same bits on every machine.
 */
#ifndef WORKER_RENDER_MATH_POINT_TREE_H
#define WORKER_RENDER_MATH_POINT_TREE_H

#include "worker/render/math/vec3.h"

#include <stddef.h>
#include <stdint.h>

struct point_tree {
	struct point_tree_node {
		vec3 p;
		uint32_t id;
	} * nodes;
	size_t count;
};

/* Reorders the nodes so that nodes[middle] is the one that sorting along the axis would put there, with no larger node
 * before it and no smaller one after it. count > 0. */
void point_tree_partition(struct point_tree_node *nodes, size_t count, size_t middle, unsigned axis);

/* Builds the tree by reordering nodes[0..count), whose memory remains the caller's; at most 2^32
 * nodes with finite positions. */
void point_tree_build(struct point_tree *t);
/* Calls `visit` for each node at most `radius` away from `center`. */
void point_tree_visit_within(const struct point_tree *t, vec3 center, double radius,
			     void (*visit)(void *user, uint32_t id), void *user);

#endif
