/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Tubes as meshes, for curves that have to be triangles (curve.h): rings of TUBE_SIDES vertices around an axis,
 * connected with each other. Radii are enlarged so that the area of a straight tube, and its width averaged over all
 * directions, are those of a round one; the silhouette deviates by at most 2.3 % of the radius. Texture coordinates: u
 * once around the tube, v as given. At the start of a tube, u is 0 in the same direction as in Mitsuba; from there this
 * direction is transported without twist.
 *
 * One thread; the mesh is in the arena.
 */
#ifndef WORKER_RENDER_SHAPE_TUBE_H
#define WORKER_RENDER_SHAPE_TUBE_H

#include "common/base/list.h"
#include "worker/render/shape/mesh.h"

enum { TUBE_SIDES = 12 };

struct tube_ring {
	vec3 center, axis; /* axis: unit */
	double radius;
	/* The normal at a vertex is (1 - offset . curvature) normal_cos e + normal_sin axis, where `offset` is the
	 * vector from the center to the vertex and e its direction. curvature: the change of the axis, c'' / |c'|^2 for
	 * a curve c. */
	double normal_cos, normal_sin;
	vec3 curvature;
	double v;
	bool starts_tube; /* begins a new tube */
};

/* Adds a ring to `rings`, a list of struct tube_ring that the caller frees by list_fini. -EFBIG if there would be more
 * triangles than a mesh may have; -ENOMEM. */
int tube_add_ring(struct list *rings, const struct tube_ring *r);
/*
 * Adds a chain of cones with spheres as joints and as ends, like Embree's round linear curves: each cone touches the
 * spheres around its two ends. points: positions and radii. The texture coordinate is v at the first point and grows by
 * v_step from point to point. Returns 0, -EFBIG or -ENOMEM.
 */
int tube_add_chain(struct list *rings, const double (*points)[4], uint32_t count, double v, double v_step);
int tube_make_mesh(const struct list *rings, struct arena *arena, struct mesh *out); /* -ENOMEM */

#endif
