/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Displacement (Cook 1984, Shade Trees): every triangle is cut into 4^level, and each point p of the finer mesh moves
 * to p + scale height(u,v) n, with n the unit normal interpolated there.
 *
 * No cracks: points of corners and edges belong to the place, not to the triangle. Vertices of the base mesh at exactly
 * the same position are one place, and edges between the same two places are one edge; if triangles disagree on normal
 * or height (creases, texture seams), the place takes the mean of both, with corners weighted by their angles.
 *
 * Normals are those of the displaced surface, from central differences of position, normal and height over one step of
 * the finer mesh, so their error falls with its square. Tangents are perpendicular to n, so height 0 gives n itself. At
 * creases and seams, where the surface bends from one vertex to the next, n turns with the triangles around it.
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
	double tessellation; /* factor of the 2^level pieces into which an edge is cut; the result is from 1 to the
				highest level's number */
};

/* For the tables of shapes: the texture, and its two numbers. */
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

/* Makes g a mesh of its own, with normals; n is for messages. -E2BIG: more triangles than MESH_TRIANGLES_MAX. */
int displace(struct shape_geometry *g, const struct displacement *d, struct arena *arena, const struct scene_node *n,
	     struct error *e);

#endif
