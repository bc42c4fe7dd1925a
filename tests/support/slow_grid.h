/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Grids of numbers (worker/render/volume/grid.h), evaluated slowly: values as weighted sums over points; integrals by
 * three points, exact for cubic polynomials, between all planes that the ray crosses, sorted.
 */
#ifndef TESTS_SUPPORT_SLOW_GRID_H
#define TESTS_SUPPORT_SLOW_GRID_H

#include "worker/render/volume/grid.h"

/* Computes the position, in cells, of the ray's point at t. */
void slow_grid_position(const struct grid *g, const struct grid_ray *r, double t, double x[3]);
/* Returns the value at a position in cells. */
double slow_grid_value(const struct grid *g, const double x[3], int channel);
bool slow_grid_contains(const struct grid *g, vec3 p); /* whether the grid's box contains p, a point in the world */
/* Returns the integral along the ray, up to t = 1000 at most. */
double slow_grid_integral(const struct grid *g, const struct grid_ray *r, int channel);

#endif
