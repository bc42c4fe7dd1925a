/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Numbers in space: on the points of a regular grid, and linear in x, y and z in each cell between eight of them, so
 * that along a ray they are a cubic polynomial in each cell. Integrals along a ray are therefore sums over the cells
 * that it passes, exact but for rounding, and so is the place where one reaches a given value. One or three channels.
 * Immutable; any thread; allocates nothing.
 */
#ifndef WORKER_RENDER_VOLUME_GRID_H
#define WORKER_RENDER_VOLUME_GRID_H

#include "worker/render/math/mat4.h"

#include <stdbool.h>
#include <stddef.h>

enum { GRID_CHANNELS_MAX = 3 };

/* What is where there are no points. */
enum grid_outside { GRID_ZERO, GRID_CLAMP, GRID_REPEAT, GRID_MIRROR };

struct grid {
	int size[3];
	int channels;		/* 1 or 3 */
	const float *value;	/* channels fastest, then x, z slowest */
	mat4 to_cells;		/* from a place in the world; points are at whole numbers */
	double low[3], high[3]; /* the box, in cells */
	bool turned;		/* to the world's axes; then the box is that around it, in the world, and `low` and
				   `high` are what it covers of the cells, at most GRID_CELL_MAX of them either way */
	vec3 least, most;	/* corners of that box */
	bool nearest;		/* instead of linear: the value of the point in the middle of a cell, which begins at
				   whole numbers */
	enum grid_outside outside;
	const unsigned char *full; /* of each brick: whether any value counts in it */
	/* NULL, or two grids of three channels with the same points, a symmetric matrix: xx yy zz, xy xz yz. Then
	 * values count sqrt(d . matrix d) times along a ray, though not in grid_at. Integrals are no longer exact:
	 * Gauss's rule with eight points is used in each cell. */
	const struct grid *area;
};

#define GRID_CELL_MAX 1e9

/* Bricks are cubes of that many cells along a side. Cells are numbered from -1 on, as some lie half outside. */
enum { GRID_BRICK = 8 };
size_t grid_bricks(const struct grid *g);
/* Marks in `full`, grid_bricks zeros, the bricks that are not empty, whatever is outside. Of the grid it needs sizes,
 * channels and values. */
void grid_find_full(const struct grid *g, unsigned char *full);

/* The values at p, three if there is one channel, too. false: p is outside of the box, where integrals count 0. */
bool grid_at(const struct grid *g, vec3 p, double value[GRID_CHANNELS_MAX]);

/* A part of a ray: o + t d for t from t0 to t1, which may be INFINITY. d: a unit vector. */
struct grid_ray {
	vec3 o, d;
	double t0, t1;
};

/* The integral of each channel over the part in the box, in units of t; 0 for channels that the grid does not have. */
void grid_integrate(const struct grid *g, const struct grid_ray *r, double sum[GRID_CHANNELS_MAX]);
/* The t at which the integral of weight[0] value[0] + ... from t0 on reaches `least`; INFINITY: not before t1. `sum` is
 * the integral of each channel up to there. Weights and values are not negative. */
double grid_reach(const struct grid *g, const struct grid_ray *r, const double weight[GRID_CHANNELS_MAX], double least,
		  double sum[GRID_CHANNELS_MAX]);

#endif
