/* SPDX-License-Identifier: Apache-2.0 */
/* What is the same for all meshes once they have been read. One thread; arrays in the arena given. */
#ifndef WORKER_RENDER_SHAPE_MESH_FINISH_H
#define WORKER_RENDER_SHAPE_MESH_FINISH_H

#include "worker/render/shape/mesh.h"

struct mesh_finish {
	mat4 to_world;
	bool flip_normals, face_normals;
	double smooth_angle; /* degrees: normals anew across edges that are less sharp (smooth.h); negative: as they are
			      */
};

/*
 * From object to world space. Drops triangles without area. Where normals are not unit vectors they count as missing
 * and are computed from the triangles around, weighted by their angles there; face_normals: there are none after all.
 * The outside stays the outside under mirrors. Triangles are wound counter-clockwise as seen from outside, which is
 * the side of their vertices' normals.
 */
int mesh_finish(struct mesh *m, const struct mesh_finish *f, struct arena *arena, uint64_t *dropped,
		const struct scene_node *n, struct error *e);

#endif
