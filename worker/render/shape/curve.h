/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The curves of a shape, given by control points, and their two representations: chains of points, between which round
 * cones are intersected (worker/render/geom/curves.h), and meshes of tubes (tube.h) for uses that need triangles.
 *
 * One thread.
 */
#ifndef WORKER_RENDER_SHAPE_CURVE_H
#define WORKER_RENDER_SHAPE_CURVE_H

#include "common/base/list.h"
#include "worker/render/shape/mesh.h"

struct curve {
	const double (*point)[4];    /* control points in world space, and their radii */
	const uint32_t *first_point; /* index of each curve's first point; first_point[curve_count] is `point_count` */
	uint32_t point_count, curve_count;
	bool is_spline; /* cubic B-splines with open ends, otherwise straight pieces */
	/* Set by curve_measure: the number of points of all chains, the bounding box of their spheres, and the largest
	 * radius. */
	uint32_t chain_point_count;
	vec3 box_min, box_max;
	double max_radius;
};

struct chain_point {
	vec3 center, tangent; /* tangent: unit, or 0 on straight pieces */
	double radius, v;
};

/* Replaces the contents of `points`, a list of struct chain_point, by the chain of curve i. The chain of a spline
 * deviates by at most a twentieth of the largest radius nearby, unless it needs more than 64 points per piece. v runs
 * from 0 to 1 over all curves. -ENOMEM. */
int curve_make_chain(const struct curve *c, uint32_t i, struct list *points);
/* Sets the members of c that describe the chains. -EFBIG if there are too many points; -ENOMEM. */
int curve_measure(struct curve *c);

/* Makes a mesh of tubes. -EFBIG if there are more triangles than a mesh may have; -ENOMEM. */
int curve_make_mesh(const struct curve *c, struct arena *arena, struct mesh *out);

#endif
