/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A thick segment around a small mesh. With it, the search for coinciding surfaces (coincide_find.c) can tell
 * that two meshes are apart without looking at their triangles: the bounding box of a long thin mesh that
 * lies askew is mostly empty.
 *
 * Lengths are those of the rescaled world. Pure; any thread; nothing fails or allocates.
 */
#ifndef WORKER_RENDER_GEOM_COINCIDE_SPINE_H
#define WORKER_RENDER_GEOM_COINCIDE_SPINE_H

#include "worker/render/geom/primitive.h"
#include "worker/render/geom/triangle.h"

struct spine {
	vec3 start, span; /* the segment is start + t span, for t in [0,1] */
	/* The whole mesh is within this distance of the segment, including a margin for rounded coordinates. */
	double radius;
	double box_min[3], box_max[3];
	vec3 direction;	 /* unit direction of the segment; 0 if the mesh is a single point */
	double max_lean; /* the largest |n.direction| of the triangles' unit normals n */
	/* The distance by which the rounding of vertices can move a triangle. */
	double rounding;
	double min_altitude; /* smallest altitude of any triangle */
};

/* A part of the segment: t in [first, last]. */
struct spine_part {
	double first, last;
};

struct spine spine_make(const struct accel_shape *mesh);

/* Sets *part to the part of the segment around everything that the mesh has in the box. Returns false if
 * the mesh is not in the box. */
bool spine_clip(const struct spine *s, const double low[3], const double high[3], struct spine_part *part);

/* Sets the extent of that part of the mesh along an axis. */
void spine_extent(const struct spine *s, struct spine_part part, unsigned axis, double *low, double *high);

/* Whether these parts of two meshes may have a point in common. */
bool spines_may_meet(const struct spine *a, struct spine_part part, const struct spine *b, struct spine_part other);

/* For a triangle of `other` with unit normal n: returns the largest |n . s->direction| at which the triangle may be
 * parallel to a triangle of s. If it is larger, coincide_triangles is false for all triangles of s. At most 2. */
double spine_max_parallel_lean(const struct spine *s, const struct spine *other);

#endif
