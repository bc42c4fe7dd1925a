/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A thick segment around a small mesh, by which the search for coinciding surfaces (coincide_find.c) tells without
 * looking at triangles that two meshes lie apart: the box of a long thin one that lies askew holds mostly nothing.
 *
 * Lengths are those of the rescaled world. Pure; any thread; nothing fails or allocates.
 */
#ifndef WORKER_RENDER_GEOM_COINCIDE_SPINE_H
#define WORKER_RENDER_GEOM_COINCIDE_SPINE_H

#include "worker/render/geom/primitive.h"
#include "worker/render/geom/triangle.h"

struct spine {
	vec3 from, along; /* the segment from + t along, t in [0,1] */
	double radius;	  /* everything is within it of the segment, with a margin for rounded coordinates */
	double low[3], high[3];
	vec3 direction; /* of unit length; 0 if all is one point */
	double lean;	/* the largest |n.direction| of the triangles' unit normals n */
	double rounded; /* how far the rounding of vertices can move one of the triangles */
	double height;	/* the smallest altitude of the triangles */
};

/* A part of the segment: t in [first, last]. */
struct spine_part {
	double first, last;
};

struct spine spine_of(const struct accel_shape *mesh);

/* The part that holds everything of the mesh in the box; false: the mesh is not in it. */
bool spine_clip(const struct spine *s, const double low[3], const double high[3], struct spine_part *part);

/* The extent of that part of the mesh along an axis. */
void spine_extent(const struct spine *s, struct spine_part part, unsigned axis, double *low, double *high);

/* Whether these parts of two meshes may have a point in common. */
bool spines_meet(const struct spine *a, struct spine_part part, const struct spine *b, struct spine_part other);

/* For triangles of `from`: the largest |n.s->direction| at which one with the unit normal n may have the direction of a
 * triangle of s; coincide_triangles is false beyond. At most 2. */
double spine_lean_at_most(const struct spine *s, const struct spine *from);

#endif
