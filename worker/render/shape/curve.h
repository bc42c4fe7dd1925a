/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Curves as a shape has them, by control points, and what they are made of: chains of points, between which round cones
 * are traced (worker/render/geom/curves.h), or a mesh of tubes (tube.h), for what needs triangles.
 *
 * One thread.
 */
#ifndef WORKER_RENDER_SHAPE_CURVE_H
#define WORKER_RENDER_SHAPE_CURVE_H

#include "common/base/list.h"
#include "worker/render/shape/mesh.h"

struct curve {
	const double (*point)[4]; /* control points in world space, and radii */
	const uint32_t *first;	  /* of each curve, and the count of points at the end */
	uint32_t count, curves;
	bool spline; /* with open ends */
	/* The chains' number of points, the box of their spheres, and the largest radius. */
	uint32_t chain_points;
	vec3 low, high;
	double thickest;
};

struct chain_point {
	vec3 center, tangent; /* unit; 0 on straight pieces */
	double radius, v;
};

/* The chain of curve i, in `points`, a list of struct chain_point; its items before are removed. A chain of a spline is
 * off by at most a twentieth of the largest radius around. v: 0 to 1 over all curves. -ENOMEM. */
int curve_chain(const struct curve *c, uint32_t i, struct list *points);
/* Sets the members that describe the chains. -EFBIG: too many points; -ENOMEM. */
int curve_measure(struct curve *c);

/* -EFBIG: more triangles than a mesh may have; -ENOMEM. */
int curve_mesh(const struct curve *c, struct arena *arena, struct mesh *out);

#endif
