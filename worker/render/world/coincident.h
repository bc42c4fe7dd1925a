/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Which surfaces of a world coincide (worker/render/geom/coincide.h), which of them is there, and what there is to say
 * of it: shapes are named where one of two shines or lets light through, or where both face the same way with different
 * materials. Opaque bodies that stand on each other are no news: nobody sees between them. One thread.
 */
#ifndef WORKER_RENDER_WORLD_COINCIDENT_H
#define WORKER_RENDER_WORLD_COINCIDENT_H

#include "worker/render/geom/coincide.h"
#include "worker/render/world/world.h"

/* One a shape of the world, in `arena`. NULL: out of memory. */
struct accel_shape *coincident_shapes(const struct world *w, struct arena *arena);
/* Sets w->coincidence and w->coincident. nodes: one a shape. */
int coincident_find(struct world *w, const struct scene_node *const *nodes, const struct accel_shape *shapes,
		    struct error *e);

#endif
