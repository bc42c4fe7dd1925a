/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Densities over the unit square that depend on two parameters, given by their values at the nodes of a grid: bilinear
 * between nodes, and linear between the parameters' values, beyond which they stay the same. Each is also the warp that
 * takes uniform numbers to that density: first y by its marginal density, then x by the conditional one. Both are
 * inverted exactly (Dupuy and Jakob 2018, An Adaptive Parameterization for Efficient Material Acquisition and
 * Rendering, section 4).
 *
 * Immutable after warp_table_make; any thread; nothing else allocates.
 */
#ifndef WORKER_RENDER_BSDF_WARP_TABLE_H
#define WORKER_RENDER_BSDF_WARP_TABLE_H

#include "common/base/arena.h"

#include <stdint.h>

/* The parameters' values, ascending, at least one each. Slice i of the first and j of the second parameter is number
 * i * count[1] + j. */
struct warp_axes {
	uint32_t count[2];
	const double *at[2];
};

/* What slices a value of the parameters lies between, and the share of each. */
struct warp_mix {
	int count;
	uint32_t slice[4];
	double weight[4]; /* they add up to 1 */
};
struct warp_mix warp_mix_at(const struct warp_axes *axes, const double parameter[2]);

struct warp_table {
	uint32_t width, height;
	const double *value;	  /* by slice and row; the integral over the square is 1 */
	const double *below_node; /* for each node the integral along its row, from x = 0 to it */
	const double *below_row;  /* for each row of a slice the integral over all x and y below it */
};

/* From `slices` tables of height x width values, at least 2 x 2: not negative, at most 2^500, and not all 0 in any
 * slice. They become part of t. -EINVAL: they are not like that. -ENOMEM. */
int warp_table_make(struct warp_table *t, uint32_t slices, uint32_t width, uint32_t height, double *value,
		    struct arena *arena);

/* u in [0, 1] -> where, and returns the density there. */
double warp_table_sample(const struct warp_table *t, const struct warp_mix *mix, const double u[2], double where[2]);
/* The other way round: the numbers that `where` is sampled by; returns the density. */
double warp_table_invert(const struct warp_table *t, const struct warp_mix *mix, const double where[2], double u[2]);
double warp_table_density(const struct warp_table *t, const struct warp_mix *mix, const double where[2]);

/* The cell of a grid of `nodes` that x in [0, 1] lies in, and how far across it. */
struct warp_cell {
	uint32_t i;
	double part;
};
static inline struct warp_cell warp_cell_at(uint32_t nodes, double x)
{
	double scaled = x * (nodes - 1), last = nodes - 2;
	uint32_t i = scaled >= last ? nodes - 2 : scaled > 0 ? (uint32_t)scaled : 0;
	return (struct warp_cell){i, scaled - i};
}

#endif
