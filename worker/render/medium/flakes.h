/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The matrices of SGGX microflakes (phase_sggx.c): symmetric and positive definite, stored as xx yy zz xy xz yz in
 * world axes, constant or linear between the points of a grid. Immutable after creation; any thread.
 */
#ifndef WORKER_RENDER_MEDIUM_FLAKES_H
#define WORKER_RENDER_MEDIUM_FLAKES_H

#include "worker/render/volume/volume.h"

enum { FLAKES_NUMBERS = 6 };

/* The smallest eigenvalue of a matrix is raised to this share of its trace, which gives flakes a roughness of at least
 * 0.001. */
#define FLAKES_EIGENVALUE_MIN 1e-6

struct flakes {
	double constant[FLAKES_NUMBERS]; /* the matrix at all places, unless has_grid */
	bool has_grid;
	struct grid grid[2]; /* if has_grid, two grids of three channels: see struct grid.area_matrix */
};

/* Reads the property `S` of node n. A matrix of 0 at a point of a grid means that there are no flakes. Returns 0 or a
 * negative error code: -EINVAL if there are not six numbers or a matrix is not positive definite, -ERANGE if a number
 * is too large, or the code of reading the file. */
int flakes_create(struct flakes *f, const struct scene_node *n, const struct volume_build *build, struct error *e);

/* Computes the matrix at a point of the world. */
void flakes_eval(const struct flakes *f, vec3 position, double s[FLAKES_NUMBERS]);

#endif
