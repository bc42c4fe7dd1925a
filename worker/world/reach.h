/*
 * Which shapes a path between camera and light can meet, and how long such a path can be: only what is proved from depth,
 * emitters that do not shine, black materials, and closed opaque shapes (cubes and spheres as the scene language makes them)
 * around others. One thread; allocates nothing.
 */
#ifndef WORKER_WORLD_REACH_H
#define WORKER_WORLD_REACH_H

#include "worker/world/world.h"

/* An emitter that shines and is not enclosed. */
bool reach_emitter(const struct world *w, const enum reach *shape, uint32_t emitter);
/* shape[]: one a shape of w. nodes: what they were made of. */
void reach_shapes(const struct world *w, const struct scene_node *const *nodes, uint32_t max_depth, enum reach *shape);
/* Edges of the longest path that can carry light: 1 where nothing scatters, 2 where all that does lies in one plane, whose points
 * do not see each other; else UINT32_MAX. */
uint32_t reach_depth(const struct world *w, const enum reach *shape);

#endif
