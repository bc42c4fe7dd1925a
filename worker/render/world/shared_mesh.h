/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Meshes that appear in several places: read once, in the coordinates of their shapegroup, and placed once, in a frame
 * of their own, with a transform for each instance. These do not share and are copied: emitters, whose surfaces are
 * sampled by area; spheres; of what does not move, meshes of few triangles, which take no more memory than a transform
 * and are computed in double where that matters (geom/accel.h); what is placed only once, or very unevenly; and
 * displaced meshes, unless they are only translated and rotated, because displacement is in scene units. One thread.
 */
#ifndef WORKER_RENDER_WORLD_SHARED_MESH_H
#define WORKER_RENDER_WORLD_SHARED_MESH_H

#include "worker/render/shape/group.h"
#include "worker/render/world/build_private.h"

enum { SHARED_TRIANGLES_MIN = 17 };

struct shared_mesh {
	struct shape_geometry geometry; /* in the shapegroup's coordinates */
	struct box box;
	bool shared; /* false: each instance is built by itself */
	bool placed; /* the following is valid */
	vec3 center;
	double scale; /* from the shapegroup's coordinates to the frame of `shape` */
	struct geom_shape shape;
	uint32_t (*turned)[3]; /* with reversed triangles; NULL: no instance is mirrored */
	uint32_t first;	       /* of the world's shapes */
};

/* Whether an instance may share its mesh, judged by its node. */
bool shared_mesh_may(const struct builder *b, const struct listed_shape *s);
/* Whether it does, now that the mesh has been read; otherwise `shared` stays false. What moves shares whatever it can.
 */
void shared_mesh_read(struct shared_mesh *m, bool moves);
/* The bounding box of an instance. -ERANGE, with the instance's line: beyond the range of coordinates. */
int shared_mesh_box(const struct shared_mesh *m, const struct scene_node *instance, struct box *box, struct error *e);
/* Makes shape `id` of the world an instance. instance: NULL for a shape that moves by itself. */
int shared_mesh_place(struct builder *b, struct shared_mesh *m, const struct scene_node *instance, uint32_t id);

#endif
