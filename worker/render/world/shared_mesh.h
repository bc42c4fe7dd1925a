/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Meshes that appear in several places. They are read once, in the coordinates of their shapegroup, and placed once,
 * in a frame of their own, with a transform for each instance. These meshes are not shared but copied: emitters,
 * whose surfaces are sampled by area; spheres; meshes of few triangles that do not move, since a copy takes no more
 * memory than a transform and is computed in double where that matters (geom/accel.h); meshes that are placed only
 * once or very unevenly; and displaced meshes, unless they are only translated and rotated, because displacement is
 * in scene units. One thread.
 */
#ifndef WORKER_RENDER_WORLD_SHARED_MESH_H
#define WORKER_RENDER_WORLD_SHARED_MESH_H

#include "worker/render/shape/group.h"
#include "worker/render/world/build_private.h"

enum { SHARED_TRIANGLES_MIN = 17 };

struct shared_mesh {
	struct shape_geometry geometry; /* in the shapegroup's coordinates */
	struct box box;
	bool is_shared; /* false: each instance is built on its own */
	bool is_placed; /* the following members are valid */
	vec3 center;
	double scale; /* factor from the shapegroup's coordinates to the frame of `shape` */
	struct geom_shape shape;
	uint32_t (*mirrored_index)[3]; /* the indices with reversed winding; NULL: no instance is mirrored */
	uint32_t first_shape;	       /* the first shape of the world that uses the mesh */
};

/* Whether an instance may share its mesh, judging by its node. */
bool shared_mesh_is_allowed(const struct builder *b, const struct listed_shape *s);
/* Sets m->is_shared if the mesh, which has been read, is shared. A shape that moves shares any mesh that it can. */
void shared_mesh_decide(struct shared_mesh *m, bool moves);
/* Computes the bounding box of an instance. -ERANGE, with the instance's line, if it leaves the range of
 * coordinates. */
int shared_mesh_box(const struct shared_mesh *m, const struct scene_node *instance, struct box *box, struct error *e);
/* Makes shape `id` of the world an instance. instance: NULL for a shape that moves on its own. */
int shared_mesh_place(struct builder *b, struct shared_mesh *m, const struct scene_node *instance, uint32_t id);

#endif
