/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Curves: chains of round cones (cone.h), each between two neighbours of a chain of spheres. A primitive is one cone
 * with the sphere at its start; the sphere at the end of a chain belongs to the last. The surface is that of the union:
 * what lies inside a neighbour along the chain is hidden, so no ray meets it from outside or from inside. Neighbours
 * are those at a distance along the chain, between the two cones, of at most twice the sum of their radii, as far as a
 * bend that is narrower than the curve can bring together; elsewhere a curve may pass through itself as meshes do.
 *
 * A point has two coordinates: `along` from 0 to 1 on the side, less by the angle on the sphere at the start, and more
 * on that at the end; and `around`, an angle from Mitsuba's direction.
 *
 * Immutable; any thread; allocates nothing.
 */
#ifndef WORKER_RENDER_GEOM_CURVES_H
#define WORKER_RENDER_GEOM_CURVES_H

#include "worker/render/geom/cone.h"

#include <stdint.h>

enum { CURVE_BEGINS = 1, CURVE_ENDS = 2, CURVE_SHIFT = 2 };

struct curves {
	uint32_t count, point_count; /* cones; points of all chains */
	float (*point)[4];	     /* center and radius */
	uint32_t *cone;		     /* of each: its first point << CURVE_SHIFT, with CURVE_BEGINS and CURVE_ENDS */
	float *start;		     /* of each cone: where u is 0, in turns from Mitsuba's direction */
	float *v;		     /* of each point */
	float (*tangent)[3];	     /* of each point, unit, for shading normals; NULL: those of the cones */
	float thickest;		     /* radius */
	bool open;		     /* chains have no spheres at their ends */
};

/* Sets `start`: at the beginning of a chain u begins where Mitsuba's does, and is carried along without twist. */
void curves_lay(struct curves *c);

vec3 curves_center(const struct curves *c, uint32_t i); /* of the i-th point */
struct cone curves_cone(const struct curves *c, uint32_t prim);
/* The box of a primitive, and of all. */
void curves_box(const struct curves *c, uint32_t prim, vec3 *low, vec3 *high);
void curves_box_of_all(const struct curves *c, vec3 *low, vec3 *high);

/* A ray or segment. */
struct curve_ray {
	vec3 o, d, end;	   /* end: o + d */
	bool starts, ends; /* o is on a primitive of these curves; end is */
	uint32_t from, to; /* on which */
	double t_min, t_max;
	bool culled; /* it leaves the curves without meeting them */
};

/* Which part of a cone is met, at which of the two roots. */
struct curve_crossing {
	double t;
	enum cone_part part;
	int root;
};

/* The nearest point of a primitive within the ray; false: none. Of each sphere and cone that an end is on, of this
 * primitive or of a neighbour, that root is divided out. */
bool curves_meet(const struct curves *c, uint32_t prim, const struct curve_ray *r, struct curve_crossing *x);
/* Of all intersections within the ray, the one nearest to t_near. */
bool curves_meet_near(const struct curves *c, uint32_t prim, const struct curve_ray *r, double t_near,
		      struct curve_crossing *x);

struct curve_site {
	double along, around;
};

/* The site of a point on this part or near it. */
struct curve_site curves_site(const struct cone *c, enum cone_part part, vec3 p);
/* The site of the primitive's point that is nearest to p. */
struct curve_site curves_nearest(const struct curves *c, uint32_t prim, vec3 p);
/* Whether the primitive has it. */
bool curves_have(const struct curves *c, uint32_t prim, struct curve_site at);

struct curve_place {
	struct cone cone;
	enum cone_part part;
	vec3 p, n;	  /* unit, outwards */
	vec3 e, side, up; /* unit: away from the axis; around it; along the surface, perpendicular to n and side */
	double x;	  /* distance from the axis */
	double s;	  /* along the side, 0 to 1 */
	double u, v;
};

void curves_place(const struct curves *c, uint32_t prim, struct curve_site at, struct curve_place *p);

#endif
