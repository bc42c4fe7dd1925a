/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Tubes as meshes, for curves of which something needs triangles (curve.h): rings of TUBE_SIDES vertices around an
 * axis, strung together. Radii are enlarged so that the area of a straight tube, and its width averaged over all
 * directions, are those of the round one; its silhouette is off by at most 2.3 % of the radius. Texture coordinates: u
 * once around, v as given. Around the axis they begin at Mitsuba's direction at the start of a tube, and are carried
 * along without twist.
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
	/* The normal of a vertex is (1 - offset . bend) cos e + sin axis, where `offset` is the vector to it from the
	 * center, and e its direction. bend: how the axis turns, c'' / |c'|^2 for a curve c. */
	double cos, sin;
	vec3 bend;
	double v;
	bool first; /* of a tube */
};

/* Rings are lists of struct tube_ring, freed by list_free. -EFBIG: more triangles than a mesh may have; -ENOMEM. */
int tube_add(struct list *rings, const struct tube_ring *r);
/*
 * A chain of cones with spheres as joints and as ends, like Embree's round linear curves: each cone touches the spheres
 * around its two ends. points: position and radius; v is 0 at the first and `v_step` more at each that follows.
 */
int tube_add_chain(struct list *rings, const double (*points)[4], uint32_t count, double v, double v_step);
int tube_mesh(const struct list *rings, struct arena *arena, struct mesh *out); /* -ENOMEM */

#endif
