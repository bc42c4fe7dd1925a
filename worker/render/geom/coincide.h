/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Surfaces that coincide: triangles that overlap in one plane as far as float vertices can tell, and spheres that are
 * one. Which of them a ray meets would be chance, and what samples points on one of them would not ask. So one rule
 * holds for whatever asks about surfaces: where some coincide only one is there, that of the least rank; of equals the
 * first. The others are hidden there.
 *
 * Found once, before Embree's tree is built: triangles are sorted into ever smaller boxes, only where those hold more
 * than one shape or one that shines (whose points are sampled by area, so that a triangle that is there twice would
 * count twice). Triangles of one shape that does not shine are left as they are: it does not matter which of them is
 * met. Work and memory are bounded in proportion to the number of triangles; where that does not do, what was found
 * holds and `incomplete` says so.
 *
 * What was found is immutable: any thread. Finding allocates and ticks (common/base/liveness.h); asking does not.
 */
#ifndef WORKER_RENDER_GEOM_COINCIDE_H
#define WORKER_RENDER_GEOM_COINCIDE_H

#include "worker/render/geom/primitive.h"
#include "worker/render/geom/triangle.h"

#include <stddef.h>
#include "common/base/error.h"

/* A primitive that is hidden, in part or wholly, by another of which it lies no farther than vertices are rounded. */
struct coincide_pair {
	struct prim_ref hidden, by;
	enum surface_rank rank; /* of `by` */
	bool wholly;
	bool same_side; /* their normals agree */
};

/* Two shapes of which primitives coincide. */
struct coincide_shapes {
	uint32_t hidden, by;
	bool same_side; /* some of them with agreeing normals */
};

struct coincidence {
	size_t pair_count, shapes_count;
	struct coincide_pair *pairs;	/* by hidden shape, hidden primitive, then as `by` ranks */
	struct coincide_shapes *shapes; /* each two once, in the same order */
	size_t *first;			/* one a shape and one more: where its pairs begin */
	bool incomplete;
};

void coincide_free(struct coincidence *c);

/* Which primitive is there at the point p of this one: itself, or what hides it. c may be NULL. */
struct prim_ref coincide_there(const struct coincidence *c, const struct accel_shape *shapes, struct prim_ref prim,
			       vec3 p);

/* Whether triangle a overlaps b in its plane: by more than the rounding of vertices makes of neighbours that touch.
 * off: by how much their vertices are off besides the rounding of their coordinates to float (struct placement). */
bool coincide_triangles(const struct triangle *a, const struct triangle *b, double off, bool *wholly);

#endif
