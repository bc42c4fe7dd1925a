/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Makes a flat list of the shapes of a scene: it has the contents of each `merge`, and for each `instance` the contents
 * of its `shapegroup`, transformed by their own to_world and then by that of the instance. The builder of the world
 * decides whether an instance shares its mesh or gets a copy.
 */
#ifndef WORKER_RENDER_SHAPE_GROUP_H
#define WORKER_RENDER_SHAPE_GROUP_H

#include "worker/render/shape/shape.h"

struct report;

enum { SHAPES_MAX = 1 << 20 };

struct listed_shape {
	const struct scene_node *node;	   /* as in the file, but at its position when the shutter opens */
	const struct scene_node *instance; /* its to_world is applied after the node's; NULL: none */
	const struct animation *animation; /* of the instance, or of the node without one; NULL: no motion */
	uint32_t first_use, use_count;	   /* position of the first shape in the list that instantiates the same node;
					      number of these shapes */
};

/* Lists the shapes in the order of the file; the list is in the arena. Moving shapes are at their positions of the time
 * `open`, and have a motion if the shutter closes later. report: collects problems, and the other shapes are still
 * listed; if NULL, the first problem ends the listing. Returns 0, -EINVAL, -ENOTSUP or -E2BIG with a sentence, or
 * -ENOMEM. */
int shape_list_make(const struct scene *s, double open, double close, struct arena *arena, struct report *report,
		    struct listed_shape **shapes, uint32_t *count, struct error *e);

/* Returns the node of a shape, or for an instance a copy in the arena whose to_world includes that of the instance.
 * NULL if out of memory. */
const struct scene_node *shape_placed_node(const struct listed_shape *s, struct arena *arena);

#endif
