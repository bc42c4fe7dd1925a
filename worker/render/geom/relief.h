/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Shading normals bent by a bump map or a normal map (worker/render/math/relief.h). A height h(u,v) gives the normal of
 * the surface p + h n as if n were constant and all heights small: it is perpendicular to dp/du + n (dh/du - n.dp/du)
 * and to the corresponding vector for v (Blinn 1978, with the tangents made orthogonal to n first). A bent normal that
 * points to the back of the triangle is ignored. A relief over another one starts from the normal that this gives.
 * Pure; any thread; allocates nothing.
 */
#ifndef WORKER_RENDER_GEOM_RELIEF_H
#define WORKER_RENDER_GEOM_RELIEF_H

#include "worker/render/math/relief.h"

/* A surface point before its normal is bent. */
struct relief_site {
	vec3 ng, n;  /* unit geometric and shading normals */
	vec3 axis;   /* the direction along which the shading frame is aligned */
	vec3 tu, tv; /* dp/du and dp/dv; 0: relief does not apply here */
	double u, v;
	double unit; /* the scene's unit of length, in the unit of tu and tv */
};

/* The derivatives of a relief_site as the point moves, per length. */
struct relief_derivatives {
	vec3 dn, daxis, dtu, dtv;
	double du, dv;
};

vec3 relief_normal(const struct relief *r, const struct relief_site *s);
/* Returns the derivative of relief_normal; always finite. */
vec3 relief_normal_derivative(const struct relief *r, const struct relief_site *s, const struct relief_derivatives *d);

#endif
