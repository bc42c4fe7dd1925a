/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Densities over the unit square that depend on two parameters, given by their values at the nodes of a grid: bilinear
 * between nodes, linear between the given values of the parameters, and constant beyond these. Each density defines a
 * warp that maps uniform numbers to points with this density: first y from its marginal density, then x from the
 * conditional one. Both are inverted exactly (Dupuy and Jakob 2018, An Adaptive Parameterization for Efficient Material
 * Acquisition and Rendering, section 4).
 *
 * Immutable after warp_table_init; any thread; nothing else allocates.
 */
#ifndef WORKER_RENDER_BSDF_WARP_TABLE_H
#define WORKER_RENDER_BSDF_WARP_TABLE_H

#include "common/base/arena.h"

#include <stdint.h>

/* The values of the two parameters, ascending, at least one each. The slice of value i of the first and j of the second
 * parameter has the number i * count[1] + j. */
struct warp_axes {
	uint32_t count[2];
	const double *value[2];
};

/* The slices to be mixed for given parameters, and the weight of each. */
struct warp_mix {
	int count;
	uint32_t slice[4];
	double weight[4]; /* sum to 1 */
};
struct warp_mix warp_mix_at(const struct warp_axes *axes, const double parameter[2]);

struct warp_table {
	uint32_t width, height;
	const double *value;	    /* by slice and row; each slice has an integral of 1 */
	const double *row_cdf;	    /* for each node, the integral along its row from x = 0 to the node */
	const double *marginal_cdf; /* for each row, the integral over all x and over y from 0 to the row */
};

/* Makes t from `slices` tables of height x width values, at least 2 x 2, which become part of t. Values must be in [0,
 * 2^500], and not all 0 in any slice, otherwise -EINVAL; -ENOMEM. */
int warp_table_init(struct warp_table *t, uint32_t slices, uint32_t width, uint32_t height, double *value,
		    struct arena *arena);

/* Maps u in [0, 1]^2 to `point`; returns the density there. */
double warp_table_sample(const struct warp_table *t, const struct warp_mix *mix, const double u[2], double point[2]);
/* Finds the numbers u that warp_table_sample maps to `point`; returns the density there. */
double warp_table_invert(const struct warp_table *t, const struct warp_mix *mix, const double point[2], double u[2]);
double warp_table_density(const struct warp_table *t, const struct warp_mix *mix, const double point[2]);

/* The cell of a grid of `nodes` nodes that x in [0, 1] lies in, and the position within it, from 0 to 1. */
struct warp_cell {
	uint32_t i;
	double fraction;
};
static inline struct warp_cell warp_cell_at(uint32_t nodes, double x)
{
	double scaled = x * (nodes - 1), last = nodes - 2;
	uint32_t i = scaled >= last ? nodes - 2 : scaled > 0 ? (uint32_t)scaled : 0;
	return (struct warp_cell){i, scaled - i};
}

#endif
