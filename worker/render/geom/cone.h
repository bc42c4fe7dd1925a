/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Round cones: the hull of two spheres. Its surface consists of a part of each sphere and, between them, the part of a
 * cone that touches both. Everything is in double. Lines are intersected with the whole sphere or the whole double cone
 * of a part, and cone_part_contains tells whether an intersection lies in the part. Pure; any thread.
 */
#ifndef WORKER_RENDER_GEOM_CONE_H
#define WORKER_RENDER_GEOM_CONE_H

#include "worker/render/math/vec3.h"

#include <stdbool.h>

struct cone {
	vec3 p0, axis; /* axis: unit; z if both centres coincide */
	double r0, r1, length;
	/* Sine and cosine of the angle by which the normals of the side lean towards the axis; sin = (r0 - r1) /
	 * length. At sin = 1 and -1 the first and the second sphere contains the other one, and the cone
	 * consists of that sphere alone. */
	double sin, cos;
};

enum cone_part { CONE_START, CONE_SIDE, CONE_END, CONE_PARTS };

struct cone cone_between(vec3 p0, double r0, vec3 p1, double r1);

/* Computes the two t at which o + t d meets the part's sphere or double cone, in ascending order. Returns false if
 * there are none or the line only touches it. The origin may be far away. */
bool cone_roots(const struct cone *c, enum cone_part part, vec3 o, vec3 d, double root[2]);
/* Returns the other root if one is known to be 0, because o is on the sphere or cone. Not finite if there is none. */
double cone_other_root(const struct cone *c, enum cone_part part, vec3 o, vec3 d);

/* Returns the signed distance of p from the part's sphere or cone, positive outside. */
double cone_height(const struct cone *c, enum cone_part part, vec3 p);
/* Whether a point p of the part's sphere or cone is in the part, or outside it by at most `slack` along the axis. */
bool cone_part_contains(const struct cone *c, enum cone_part part, vec3 p, double slack);

/* Returns the signed distance of p from the surface of the cone, negative inside. open_start, open_end: the sphere at
 * that end is not part of the surface; then the distance of points beyond that end is INFINITY. */
double cone_distance(const struct cone *c, vec3 p, bool open_start, bool open_end);

#endif
