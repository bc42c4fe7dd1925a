/* SPDX-License-Identifier: Apache-2.0 */
/* The steps that all meshes share after they have been read. One thread; arrays in the given arena. */
#ifndef WORKER_RENDER_SHAPE_MESH_FINISH_H
#define WORKER_RENDER_SHAPE_MESH_FINISH_H

#include "worker/render/shape/mesh.h"

struct mesh_finish_options {
	mat4 to_world;
	bool flips_normals, has_face_normals;
	double max_smooth_angle; /* degrees; normals are recomputed across edges less sharp than this (smooth.h);
				negative: normals are kept */
};

/*
 * Transforms m from object to world space and drops triangles without area; *dropped: their number. Normals that are 0
 * or not finite count as missing and are computed from the adjacent triangles, weighted by angle; has_face_normals
 * removes all normals. A transform that mirrors does not swap inside and outside. Triangles are wound counter-clockwise
 * seen from outside, which is the side of their vertices' normals. Returns 0 or a negative error code; errors name n.
 */
int mesh_finish(struct mesh *m, const struct mesh_finish_options *f, struct arena *arena, uint64_t *dropped,
		const struct scene_node *n, struct error *e);

#endif
