/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The shapes of a scene as a flat list: the contents of each `merge`, and for each `instance` the contents of its
 * `shapegroup`, placed by the instance's to_world after their own. Whether an instance shares its mesh or is copied is
 * decided by the builder of the world.
 */
#ifndef WORKER_RENDER_SHAPE_GROUP_H
#define WORKER_RENDER_SHAPE_GROUP_H

#include "worker/render/shape/shape.h"

struct report;

enum { SHAPES_MAX = 1 << 20 };

struct listed_shape {
	const struct scene_node *node;	   /* as in the file, but still */
	const struct scene_node *instance; /* whose to_world is applied after the node's; NULL: none */
	const struct animation *moves;	   /* of the instance, or the node if there is none; NULL: it is still */
	uint32_t first, uses;		   /* the first in the list of those that instantiate the same node; how many */
};

/* In the file's order, in the arena. What moves stands where it is at the time `open`; it moves on if the shutter is
 * open until a later one. found: gets what is wrong, and the rest is listed; NULL: the first problem ends it. -EINVAL,
 * -ENOTSUP, -E2BIG with a sentence, -ENOMEM. */
int shape_list(const struct scene *s, double open, double close, struct arena *arena, struct report *found,
	       struct listed_shape **shapes, uint32_t *count, struct error *e);

/* The node itself, or a copy in the arena with the instance's to_world after its own; NULL: out of memory. */
const struct scene_node *shape_placed(const struct listed_shape *s, struct arena *arena);

#endif
