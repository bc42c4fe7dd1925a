/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Meshes for tests of geometry: closed bodies without cracks (vertices are shared) and exactly flat planes.
 */
#ifndef TESTS_SUPPORT_BODIES_H
#define TESTS_SUPPORT_BODIES_H

#include "tests/support/dice.h"
#include "worker/render/geom/surface.h"

/* Makes a sphere of this radius around the origin from a cube with n x n squares on each face; `bump` moves vertices
 * along the radius by up to that fraction, up and down. Normals point outwards. */
void body_make_ball(struct geom_shape *s, uint32_t n, double radius, double bump);
/* Makes the square [-1,1]^2 of n x n squares (n a power of two), on which z = a x + b y; exact in float for dyadic a
 * and b. */
void body_make_plane(struct geom_shape *s, uint32_t n, double a, double b);
void body_fini(struct geom_shape *s);

struct accel *body_build_accel(const struct geom_shape *shapes, uint32_t count);

/* Returns a random point: uniform in a randomly chosen triangle; uniform on a sphere. */
struct surface_point body_sample_point(const struct geom_shape *s, uint32_t shape, struct dice *d);
struct ray_end body_ray_end(const struct surface_point *x);

/* Returns the distance to the nearest triangle of the shape beyond t_min, by testing every triangle in double;
 * INFINITY if there is none. */
double body_hit_distance(const struct geom_shape *s, vec3 o, vec3 d, double t_min, uint32_t *prim);

#endif
