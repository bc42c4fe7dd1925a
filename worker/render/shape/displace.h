/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Displacement (Cook 1984, Shade Trees): every triangle is subdivided into 4^level, and each point p of the finer mesh
 * moves to p + scale height(u,v) n, with n the unit normal interpolated there.
 *
 * There are no cracks, because points on corners and edges belong to a place, not to a triangle. Vertices of the base
 * mesh at exactly the same position are one place, and edges between the same two places are one edge. If triangles
 * disagree on the normal or the height at a place (creases, texture seams), the place gets the means, with corners
 * weighted by their angles.
 *
 * Normals are those of the displaced surface, from central differences of position, normal and height over one step of
 * the finer mesh, so that their error decreases with the square of the step. Tangents are perpendicular to n, so a
 * height of 0 gives n itself. At creases and seams, where the surface bends between adjacent vertices, n turns with the
 * triangles around it.
 *
 * A sphere becomes a mesh of 8 * 4^level triangles (an octahedron projected onto the sphere) with the sphere's (u,v).
 * One thread. Allocates in the given arena; temporary memory is freed.
 */
#ifndef WORKER_RENDER_SHAPE_DISPLACE_H
#define WORKER_RENDER_SHAPE_DISPLACE_H

#include "worker/render/shape/shape.h"

enum { DISPLACE_LEVEL_MAX = 13 };

struct displacement {
	double (*height)(const void *user, double u, double v); /* finite */
	const void *user;
	bool is_constant; /* needs no texture coordinates */
	double scale;	  /* world units */
	uint32_t level;
	double tessellation; /* factor of the 2^level pieces of an edge; the product is rounded, and limited to 1 ..
				2^DISPLACE_LEVEL_MAX */
};

/* For the declarations of shapes: the texture, its scale and the level. */
#define DISPLACE_PARAMS                                                                               \
	{.name = "displacement",                                                                      \
	 .types = VALUE_FLOAT | VALUE_NODE,                                                           \
	 .min = -PARAM_LENGTH_MAX,                                                                    \
	 .max = PARAM_LENGTH_MAX},                                                                    \
		{.name = "displacement_scale",                                                        \
		 .types = VALUE_FLOAT,                                                                \
		 .min = -PARAM_LENGTH_MAX,                                                            \
		 .max = PARAM_LENGTH_MAX},                                                            \
	{                                                                                             \
		.name = "displacement_level", .types = VALUE_INT, .min = 0, .max = DISPLACE_LEVEL_MAX \
	}

/* Replaces g by the displaced mesh, which has normals; errors name n. Returns 0, -E2BIG if there would be more than
 * MESH_TRIANGLES_MAX triangles, -EINVAL if texture coordinates are missing, -ERANGE or -ENOMEM. */
int displace_geometry(struct shape_geometry *g, const struct displacement *d, struct arena *arena,
		      const struct scene_node *n, struct error *e);

#endif
