/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Finds the surfaces of a world that coincide (worker/render/geom/coincide.h), which of them are present, and
 * makes the notes about them. Shapes are named if one of the two emits or transmits light, or if both face the
 * same way with different materials. Opaque bodies that touch are not mentioned, because the surfaces between them
 * cannot be seen. One thread.
 */
#ifndef WORKER_RENDER_WORLD_BUILD_COINCIDENCE_H
#define WORKER_RENDER_WORLD_BUILD_COINCIDENCE_H

#include "worker/render/geom/coincide.h"
#include "worker/render/world/world.h"

/* Returns one accel_shape per shape of the world, in `arena`; NULL if out of memory. */
struct accel_shape *build_coincidence_make_shapes(const struct world *w, struct arena *arena);
/* Sets w->coincidence and w->coincidence_notes. nodes: one per shape. Returns -ENOMEM if out of memory. */
int build_coincidence_find(struct world *w, const struct scene_node *const *nodes, const struct accel_shape *shapes,
			   struct error *e);

#endif
