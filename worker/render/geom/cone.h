/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Round cones: the hull of two spheres, whose surface is a part of each sphere and, between them, the part of a cone
 * that touches both. Everything is in double; lines are cut with the whole sphere or the whole double cone of a part,
 * and cone_has tells whether a point of that is in the part. Pure; any thread.
 */
#ifndef WORKER_RENDER_GEOM_CONE_H
#define WORKER_RENDER_GEOM_CONE_H

#include "worker/render/math/vec3.h"

#include <stdbool.h>

struct cone {
	vec3 p0, axis; /* axis: unit; z where both centers are the same point */
	double r0, r1, length;
	double sin, cos; /* of the angle by which the normals of the side lean towards the axis, (r0 - r1) / length; at
			    1 and -1 the first and the second sphere contains the other, and is all there is */
};

enum cone_part { CONE_START, CONE_SIDE, CONE_END, CONE_PARTS };

struct cone cone_between(vec3 p0, double r0, vec3 p1, double r1);

/* The two t at which o + t d meets the part's sphere or double cone, ascending; false: none, or it only touches. The
 * ray may start far away. */
bool cone_roots(const struct cone *c, enum cone_part part, vec3 o, vec3 d, double root[2]);
/* The other of the two where one is known to be 0: o is on it. Not finite where there is none. */
double cone_other_root(const struct cone *c, enum cone_part part, vec3 o, vec3 d);

/* The signed distance of p from the part's sphere or cone, positive outside. */
double cone_height(const struct cone *c, enum cone_part part, vec3 p);
/* Whether a point of the part's sphere or cone is in the part, or off by no more than `slack` along the axis. */
bool cone_has(const struct cone *c, enum cone_part part, vec3 p, double slack);

/* The signed distance of p from the surface, negative inside. open_start, open_end: that sphere's part is no part of
 * it, and INFINITY is the distance from there. */
double cone_distance(const struct cone *c, vec3 p, bool open_start, bool open_end);

#endif
