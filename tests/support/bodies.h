/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Meshes for tests of geometry, made here: closed bodies without cracks (vertices are shared) and exactly flat planes.
 */
#ifndef TESTS_SUPPORT_BODIES_H
#define TESTS_SUPPORT_BODIES_H

#include "tests/support/dice.h"
#include "worker/render/geom/surface.h"

/* A sphere of the given radius around the origin from a cube of n x n squares a face; `bump` moves vertices along the
 * radius by that share, up and down. Normals point outwards. */
void body_ball(struct geom_shape *s, uint32_t n, double radius, double bump);
/* The square [-1,1]^2 of n x n squares (n a power of two), over which z = a x + b y; exact in float for dyadic a and b.
 */
void body_plane(struct geom_shape *s, uint32_t n, double a, double b);
void body_free(struct geom_shape *s);

struct accel *body_accel(const struct geom_shape *shapes, uint32_t count);

/* A random point: the triangle by its number, uniform inside it; on a sphere uniform. */
struct surface_point body_point(const struct geom_shape *s, uint32_t shape, struct dice *d);
struct ray_end body_end(const struct surface_point *x);

/* Every triangle of the shape tried in double: the nearest beyond t_min, INFINITY when there is none. */
double body_nearest(const struct geom_shape *s, vec3 o, vec3 d, double t_min, uint32_t *prim);

#endif
