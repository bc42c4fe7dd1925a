/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Curves: chains of round cones (cone.h), each between two neighbours of a chain of spheres. A primitive is one
 * cone with the sphere at its start; the sphere at the end of a chain belongs to the last primitive. The surface
 * is that of the union: the part of a primitive inside a neighbour along the chain is hidden, so no ray meets it
 * from outside or from inside. Cones are neighbours if their distance along the chain is at most twice the sum of
 * their radii, which covers what a bend narrower than the curve can bring together; elsewhere a curve may pass
 * through itself, as meshes do.
 *
 * A point has two coordinates. `along` goes from 0 to 1 on the side; on the sphere at the start it is less by an angle,
 * and on that at the end it is more. `around` is an angle, counted from the same direction as in Mitsuba.
 *
 * Immutable; any thread; allocates nothing.
 */
#ifndef WORKER_RENDER_GEOM_CURVES_H
#define WORKER_RENDER_GEOM_CURVES_H

#include "worker/render/geom/cone.h"

#include <stdint.h>

enum { CURVE_BEGINS = 1, CURVE_ENDS = 2, CURVE_SHIFT = 2 };

struct curves {
	uint32_t count, point_count; /* number of cones; number of points of all chains */
	float (*points)[4];	     /* centre and radius */
	/* For each cone: index of its first point << CURVE_SHIFT, with the flags CURVE_BEGINS and CURVE_ENDS. */
	uint32_t *cone;
	/* For each cone: where u is 0, in turns from Mitsuba's direction. */
	float *u_start;
	float *v; /* texture coordinate v of each point */
	/* Unit tangent of each point, for shading normals; NULL: those of the cones are used. */
	float (*tangent)[3];
	float max_radius;
	bool is_open; /* chains have no spheres at their ends */
};

/* Sets `u_start`: at the beginning of a chain u starts at Mitsuba's direction, which is then carried along
 * the chain without twist. */
void curves_compute_u_starts(struct curves *c);

vec3 curves_center(const struct curves *c, uint32_t i); /* centre of the i-th point */
struct cone curves_cone(const struct curves *c, uint32_t prim);
/* The bounding boxes of a primitive and of all primitives. */
void curves_box(const struct curves *c, uint32_t prim, vec3 *low, vec3 *high);
void curves_bounds(const struct curves *c, vec3 *low, vec3 *high);

/* A ray or segment. */
struct curve_ray {
	vec3 o, d, end; /* end is o + d, for segments */
	/* Whether o, and end, is on a primitive of these curves. */
	bool starts_on_curve, ends_on_curve;
	uint32_t start_prim, end_prim; /* the primitives on which o and end are */
	double t_min, t_max;
	bool culls_backfaces; /* the ray does not meet curves from inside */
};

/* A crossing of a cone: which part is met, and at which of the two roots. */
struct curve_crossing {
	double t;
	enum cone_part part;
	int root;
};

/* Finds the nearest crossing of a primitive within the ray's range; returns false if there is none. If an end of the
 * ray is on a sphere or cone, of this primitive or of a neighbour, the root at that end is divided out. */
bool curves_intersect(const struct curves *c, uint32_t prim, const struct curve_ray *r, struct curve_crossing *x);
/* Like curves_intersect(), but finds the crossing nearest to t_near. */
bool curves_intersect_near(const struct curves *c, uint32_t prim, const struct curve_ray *r, double t_near,
			   struct curve_crossing *x);

struct curve_coordinates {
	double along, around;
};

/* Returns the coordinates of a point on this part or near it. */
struct curve_coordinates curves_coordinates(const struct cone *c, enum cone_part part, vec3 p);
/* Returns the coordinates of the primitive's point that is nearest to p. */
struct curve_coordinates curves_nearest_coordinates(const struct curves *c, uint32_t prim, vec3 p);
/* Whether the primitive has a point with these coordinates. */
bool curves_have_point(const struct curves *c, uint32_t prim, struct curve_coordinates coordinates);

struct curve_point {
	struct cone cone;
	enum cone_part part;
	vec3 p, n; /* n: unit normal, outwards */
	/* Unit vectors: radial from the axis, side around it, up along the surface, perpendicular to n and side. */
	vec3 radial, side, up;
	double axis_distance;
	double side_position; /* from 0 to 1 */
	double u, v;
};

void curves_compute_point(const struct curves *c, uint32_t prim, struct curve_coordinates coordinates,
			  struct curve_point *p);

#endif
