/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Shared by the files that build a world: build.c, which runs the steps in order, geometry.c, which makes shapes, and
 * shared_mesh.c. One thread.
 */
#ifndef WORKER_RENDER_WORLD_BUILD_PRIVATE_H
#define WORKER_RENDER_WORLD_BUILD_PRIVATE_H

#include "worker/render/scene/report.h"
#include "worker/render/shape/shape.h"
#include "worker/render/texture/attribute_table.h"
#include "worker/render/volume/grid_file.h"
#include "worker/render/volume/volume.h"
#include "worker/render/world/origin.h"
#include "worker/render/world/world.h"

#include <string.h>

/* Data needed for building, but not in the world. */
struct builder {
	struct world *w;
	const struct scene *scene;
	const struct asset_source *assets;
	struct arena scratch;
	/* One per shape: its geometry in double; for an instance the mesh that it shares, and the instance,
	 * otherwise NULL. */
	struct shape_geometry *geometry;
	struct shared_mesh **shared;
	const struct scene_node **instances;
	struct motion **motions; /* in scene units, applied after what has been built; NULL: still */
	uint64_t triangles;	 /* over all meshes, shared ones once */
	const struct scene_node **shape_nodes, **bsdf_nodes, **emitter_nodes;
	struct effects_choice forced;
	struct attribute_pool attributes;
	struct grid_cache grids;
	struct volume_build volumes; /* with `grids` */
	struct box all, *boxes;	     /* boxes: one a shape */
	bool lost_light;	     /* a shape that shines was left out, because it has no area */
	struct report *found;	     /* the problems after which building goes on; NULL: the first ends it */
	struct error *e;
};

/* An object has failed with `code`. 0: the problem is noted, and building goes on without the object. */
static inline int build_go_on(struct builder *b, int code)
{
	return b->found ? report_problem_once(b->found, code, b->e) : code;
}

static inline int build_out_of_memory(struct error *e)
{
	return error_set(e, ENOMEM, "out of memory while building the scene");
}

#endif
