/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The shapes of a scene one by one: what is in a `merge`, and for each `instance` all that is in its `shapegroup`, to
 * be placed by the instance's to_world after its own. Whether an instance shares its mesh with others or is built as if
 * it were written out is up to the builder of the world.
 */
#ifndef WORKER_RENDER_SHAPE_GROUP_H
#define WORKER_RENDER_SHAPE_GROUP_H

#include "worker/render/shape/shape.h"

enum { SHAPES_MAX = 1 << 20 };

struct listed_shape {
	const struct scene_node *node;	   /* as it is in the file */
	const struct scene_node *instance; /* whose to_world comes after the node's; NULL: none */
	uint32_t first, uses; /* the first in the list of those that are the same node in instances; how many */
};

/* In the file's order, in the arena. -EINVAL, -ENOTSUP, -E2BIG with a sentence, -ENOMEM. */
int shape_list(const struct scene *s, struct arena *arena, struct listed_shape **shapes, uint32_t *count,
	       struct error *e);

/* The node itself, or a copy in the arena with the instance's to_world after its own; NULL: out of memory. */
const struct scene_node *shape_placed(const struct listed_shape *s, struct arena *arena);

#endif
