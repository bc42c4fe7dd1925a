/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Shared by the files that build a world: build.c, which runs the steps in order, geometry.c, which makes shapes,
 * shared_mesh.c and others. One thread.
 */
#ifndef WORKER_RENDER_WORLD_BUILD_PRIVATE_H
#define WORKER_RENDER_WORLD_BUILD_PRIVATE_H

#include "worker/render/scene/report.h"
#include "worker/render/shape/shape.h"
#include "worker/render/texture/attribute_table.h"
#include "worker/render/volume/grid_file.h"
#include "worker/render/volume/volume.h"
#include "worker/render/world/world_origin.h"
#include "worker/render/world/world.h"

#include <string.h>

/* Data that is only needed while building. */
struct builder {
	struct world *w;
	const struct scene *scene;
	const struct asset_source *assets;
	struct arena scratch;
	/* One entry per shape: its geometry in double; for an instance, the mesh that it shares and the
	 * instance node, otherwise NULL. */
	struct shape_geometry *geometry;
	struct shared_mesh **shared_meshes;
	const struct scene_node **instances;
	/* One per shape, in scene units, applied to the shape as it was built; NULL: the shape does not move. */
	struct motion **motions;
	uint64_t triangle_count; /* total over all meshes, counting shared meshes once */
	const struct scene_node **shape_nodes, **bsdf_nodes, **emitter_nodes;
	struct effects_override forced_effects;
	struct attribute_pool attributes;
	struct grid_cache grids;
	struct volume_build volumes; /* uses `grids` */
	/* Bounding box of the scene, and one box per shape. */
	struct box scene_box, *shape_boxes;
	/* A shape that emits was left out because it has no area. */
	bool has_dropped_emitter;
	/* Collects problems after which building continues; NULL: the first problem ends it. */
	struct report *report;
	struct error *e;
};

/* Call if an object has failed with `code`. Returns 0 if the problem was recorded and building continues without the
 * object; otherwise the error code. */
static inline int build_record_problem(struct builder *b, int code)
{
	return b->report ? report_problem_once(b->report, code, b->e) : code;
}

static inline int build_out_of_memory(struct error *e)
{
	return error_set(e, ENOMEM, "out of memory while building the scene");
}

#endif
