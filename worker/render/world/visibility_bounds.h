/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Finds which shapes a path between camera and light can meet, and how long such a path can be, as far as that can be
 * proved from the depth, emitters without light, black materials, and closed opaque shapes (cubes and spheres as the
 * scene language makes them) around others. One thread; allocates nothing.
 */
#ifndef WORKER_RENDER_WORLD_VISIBILITY_BOUNDS_H
#define WORKER_RENDER_WORLD_VISIBILITY_BOUNDS_H

#include "worker/render/world/world.h"

struct box;
struct weighted_value;

struct bsdf_visibility {
	enum visibility visibility; /* visibility of the shapes that use the BSDF */
	bool has_shape;
};

/* The nodes from which the world's parts were made. */
struct effects_source {
	const struct scene *scene;
	/* One per shape, and one per BSDF; NULL: the default BSDF. */
	const struct scene_node *const *shape_nodes, *const *bsdf_nodes;
	const struct scene_node *const *emitter_nodes; /* one per emitter */
	const struct scene_node *sensor;	       /* NULL: the scene has none */
	uint32_t max_depth;			       /* as requested; 0: the scene's value */
	const struct box *boxes;		       /* one per shape, in any unit */
	struct weighted_value *scratch;		       /* space for one per shape */
	struct bsdf_visibility *bsdf_visibility;       /* space for one per BSDF */
};

/* Whether an emitter has power and is not enclosed. */
bool visibility_bounds_see_emitter(const struct world *w, const enum visibility *shape, uint32_t emitter);
/* Fills in shape[], one entry per shape of w. max_depth: edges. */
void visibility_bounds_shapes(const struct world *w, const struct effects_source *src, uint32_t max_depth,
			      enum visibility *shape);
/* Returns the number of edges of the longest path that can carry light: 1 if nothing scatters; 2 if everything that
 * scatters is in one plane, because its points do not see each other; otherwise UINT32_MAX. */
uint32_t visibility_bounds_depth(const struct world *w, const enum visibility *shape);

#endif
