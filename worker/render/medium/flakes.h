/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The matrices of SGGX microflakes (phase_sggx.c): symmetric and positive definite, as xx yy zz xy xz yz in the world's
 * axes, the same everywhere or linear between the points of a grid. Immutable after creation; any thread.
 */
#ifndef WORKER_RENDER_MEDIUM_FLAKES_H
#define WORKER_RENDER_MEDIUM_FLAKES_H

#include "worker/render/volume/volume.h"

enum { FLAKES_NUMBERS = 6 };

/* The smallest eigenvalue of a matrix is raised to this share of its trace: flakes are rough by 0.001 at least. */
#define FLAKES_LEAST 1e-6

struct flakes {
	double even[FLAKES_NUMBERS];
	bool uneven;
	struct grid grid[2]; /* if uneven, of three channels each: see struct grid.area */
};

/* Reads the property `S` of node n. Where the matrix of a grid's point is 0, there are no flakes. -EINVAL, -ERANGE: not
 * six numbers, too large ones, a matrix that is not positive definite; those of the file. */
int flakes_create(struct flakes *f, const struct scene_node *n, const struct volume_build *build, struct error *e);

void flakes_at(const struct flakes *f, vec3 at, double s[FLAKES_NUMBERS]);

#endif
