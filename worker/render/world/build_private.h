/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What the files that build a world share: build.c, which runs the steps in order, geometry.c, which has those that
 * make shapes, and shared_mesh.c. One thread.
 */
#ifndef WORKER_RENDER_WORLD_BUILD_PRIVATE_H
#define WORKER_RENDER_WORLD_BUILD_PRIVATE_H

#include "worker/render/shape/shape.h"
#include "worker/render/texture/attribute_table.h"
#include "worker/render/world/origin.h"
#include "worker/render/world/world.h"

/* What building needs and the world does not. */
struct builder {
	struct world *w;
	const struct scene *scene;
	const struct asset_source *assets;
	struct arena scratch;
	/* One a shape: its geometry in double; of an instance the mesh that it shares, and the instance, else NULL. */
	struct shape_geometry *geometry;
	struct shared_mesh **shared;
	const struct scene_node **instances;
	uint64_t triangles; /* of all meshes, shared ones once */
	const struct scene_node **shape_nodes, **bsdf_nodes, **emitter_nodes;
	struct effects_choice forced;
	struct attribute_pool attributes;
	struct emitter_surface *surfaces;
	struct box all, *boxes; /* boxes: one a shape */
	struct error *e;
};

static inline int build_out_of_memory(struct error *e)
{
	return error_set(e, ENOMEM, "out of memory while building the scene");
}

#endif
