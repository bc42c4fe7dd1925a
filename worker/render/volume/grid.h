/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A function in space, given at the points of a regular grid and trilinear in the cells between them, so that along a
 * ray it is a cubic polynomial in each cell. Integrals along a ray are sums over the cells that it passes; they are
 * exact but for rounding, and so is the position at which an integral reaches a given value. One or three channels.
 * Immutable; any thread; allocates nothing.
 */
#ifndef WORKER_RENDER_VOLUME_GRID_H
#define WORKER_RENDER_VOLUME_GRID_H

#include "worker/render/math/mat4.h"

#include <stdbool.h>
#include <stddef.h>

enum { GRID_CHANNELS_MAX = 3 };

/* The values beyond the outermost points. */
enum grid_wrap { GRID_ZERO, GRID_CLAMP, GRID_REPEAT, GRID_MIRROR };

struct grid {
	int size[3];
	int channels;			 /* 1 or 3 */
	const float *value;		 /* channels vary fastest, then x, then y, then z */
	mat4 to_cells;			 /* from the world to cells; points are at integers */
	double cell_min[3], cell_max[3]; /* the box, in cells */
	bool is_world_aligned;	   /* the box is [world_min, world_max] in the world instead, parallel to its axes;
				      `cell_min` and `cell_max` then bound it in cells, limited to +-GRID_CELL_MAX */
	vec3 world_min, world_max; /* corners of the box if `is_world_aligned` */
	bool is_nearest;	   /* constant in each cell instead of linear; cells begin at integers */
	enum grid_wrap wrap;
	const unsigned char *occupied_bricks; /* for each brick, whether a value other than 0 counts in it */
	/* NULL, or two grids of three channels with the same points, which hold a symmetric matrix: xx yy zz, xy xz yz.
	 * Along a ray of direction d, values are then multiplied by sqrt(d . matrix d), but not in grid_eval. Integrals
	 * are no longer exact: Gauss's rule with eight points is used in each cell. */
	const struct grid *area_matrix;
};

#define GRID_CELL_MAX 1e9

/* Bricks are cubes of GRID_BRICK cells per side. Cells are numbered from -1, since the outermost lie half outside the
 * points. grid_brick_count returns the number of bricks. */
enum { GRID_BRICK = 8 };
size_t grid_brick_count(const struct grid *g);
/* Sets the elements of `occupied`, grid_brick_count() zeros, of all bricks that are not empty, whatever g->wrap
 * is. Needs only the sizes, channels and values of g. */
void grid_find_occupied_bricks(const struct grid *g, unsigned char *occupied);

/* Computes the values at p; a single channel is copied to all three. Returns false if p is outside the box, where
 * integrals take the value as 0. */
bool grid_eval(const struct grid *g, vec3 p, double value[GRID_CHANNELS_MAX]);

/* A segment of a ray: o + t d for t from t0 to t1, which may be INFINITY; d is a unit vector. */
struct grid_ray {
	vec3 o, d;
	double t0, t1;
};

/* Computes the integral of each channel over the part of the segment in the box, in units of t; 0 for channels that the
 * grid does not have. */
void grid_integrate(const struct grid *g, const struct grid_ray *r, double sum[GRID_CHANNELS_MAX]);
/* Returns the t at which the integral of weight[0] value[0] + ... from t0 reaches `target`, or INFINITY if it does
 * not before t1. sum: the integral of each channel up to that t. Weights and values must not be negative. */
double grid_invert_integral(const struct grid *g, const struct grid_ray *r, const double weight[GRID_CHANNELS_MAX],
			    double target, double sum[GRID_CHANNELS_MAX]);

#endif
