/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Shading normals bent by a bump map or a normal map (worker/render/math/relief.h). A height h(u,v) gives the normal
 * that the surface p + h n would have if n did not turn and all heights were small: across dp/du + n (dh/du - n.dp/du)
 * and the same of v (Blinn 1978, with the tangents made orthogonal to n first). A bent normal that looks to the back of
 * the triangle is not taken. Pure; any thread; allocates nothing.
 */
#ifndef WORKER_RENDER_GEOM_RELIEF_H
#define WORKER_RENDER_GEOM_RELIEF_H

#include "worker/render/math/frame.h"
#include "worker/render/math/relief.h"

/* A point of a surface before it is bent. */
struct relief_site {
	vec3 ng, n;  /* unit: geometric and shading normal */
	vec3 axis;   /* what the shading frame is laid along */
	vec3 tu, tv; /* dp/du, dp/dv; 0: the surface has no use for relief here */
	double u, v;
	double unit; /* of the scene's length, in that of tu and tv */
};

/* How these change as the point moves, per length. */
struct relief_step {
	vec3 dn, daxis, dtu, dtv;
	double du, dv;
};

vec3 relief_normal(const struct relief *r, const struct relief_site *s);
/* The derivative of relief_normal; finite. */
vec3 relief_turn(const struct relief *r, const struct relief_site *s, const struct relief_step *d);

#endif
