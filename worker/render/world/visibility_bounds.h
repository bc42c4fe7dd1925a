/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Which shapes a path between camera and light can meet, and how long such a path can be: only what is proved from
 * depth, emitters that do not shine, black materials, and closed opaque shapes (cubes and spheres as the scene language
 * makes them) around others. One thread; allocates nothing.
 */
#ifndef WORKER_RENDER_WORLD_VISIBILITY_BOUNDS_H
#define WORKER_RENDER_WORLD_VISIBILITY_BOUNDS_H

#include "worker/render/world/world.h"

struct box;
struct weighed;

struct bsdf_reach {
	enum visibility_bounds reach; /* of its shapes */
	bool met;		      /* it has one */
};

/* The nodes that the world's parts were made of. */
struct effects_source {
	const struct scene *scene;
	const struct scene_node *const *shape, *const *bsdf; /* one a shape; one a BSDF, NULL: the default one */
	const struct scene_node *const *emitter;	     /* one an emitter */
	uint32_t max_depth;				     /* asked for; 0: the scene's */
	const struct box *box;				     /* one a shape, in any units */
	struct weighed *room;				     /* for one a shape */
	struct bsdf_reach *reach;			     /* for one a BSDF */
};

/* An emitter that shines and is not enclosed. */
bool visibility_bounds_emitter(const struct world *w, const enum visibility_bounds *shape, uint32_t emitter);
/* shape[]: one a shape of w. max_depth: edges. */
void visibility_bounds_shapes(const struct world *w, const struct effects_source *src, uint32_t max_depth,
			      enum visibility_bounds *shape);
/* Edges of the longest path that can carry light: 1 where nothing scatters, 2 where all that does lies in one plane,
 * whose points do not see each other; else UINT32_MAX. */
uint32_t visibility_bounds_depth(const struct world *w, const enum visibility_bounds *shape);

#endif
