/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Grids of numbers (worker/render/volume/grid.h) the slow way: values as weighted sums over points, integrals by
 * three points, which are exact for cubic polynomials, between all planes that the ray crosses anywhere, sorted.
 */
#ifndef TESTS_SUPPORT_SLOW_GRID_H
#define TESTS_SUPPORT_SLOW_GRID_H

#include "worker/render/volume/grid.h"

/* Of a ray's point. */
void slow_grid_cells(const struct grid *g, const struct grid_ray *r, double t, double x[3]);
/* At a place in cells. */
double slow_grid_value(const struct grid *g, const double x[3], int channel);
bool slow_grid_has(const struct grid *g, vec3 p); /* its box does, a place in the world */
/* Up to 1000 at most. */
double slow_grid_integral(const struct grid *g, const struct grid_ray *r, int channel);

#endif
