/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Which surfaces of a world coincide (worker/render/geom/coincide.h), which of them are present, and the notes about
 * it: shapes are named if one of two emits or transmits light, or if both face the same way with different materials.
 * Opaque bodies that stand on each other are not mentioned, because nobody sees between them. One thread.
 */
#ifndef WORKER_RENDER_WORLD_COINCIDENT_H
#define WORKER_RENDER_WORLD_COINCIDENT_H

#include "worker/render/geom/coincide.h"
#include "worker/render/world/world.h"

/* One per shape of the world, in `arena`. NULL: out of memory. */
struct accel_shape *coincident_shapes(const struct world *w, struct arena *arena);
/* Sets w->coincidence and w->coincident. nodes: one per shape. */
int coincident_find(struct world *w, const struct scene_node *const *nodes, const struct accel_shape *shapes,
		    struct error *e);

#endif
