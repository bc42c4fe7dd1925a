/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The film of one lease: a sum in double for each pixel of the crop, rounded once when the tiles are taken. Every
 * integrator splats with the continuous filter kernel, normalised to integral 1 over the plane (docs/design.md, rules
 * 3). One thread. Memory: 24 bytes per pixel, of which only touched pages cost anything; splatting allocates nothing.
 */
#ifndef WORKER_RENDER_FILM_SUMS_H
#define WORKER_RENDER_FILM_SUMS_H

#include "common/film/batch.h"
#include "worker/render/path/path.h"
#include "worker/render/film/moments.h"

struct film_sums {
	struct splat_target target;   /* splats by film_sums_splat() */
	uint32_t x, y, width, height; /* the crop */
	uint32_t tiles_x, tiles_y;
	/* Width and height of a panorama, where kernels reach around the edges; 0 for other films. */
	double panorama_size[2];
	enum filter_kind filter;
	double filter_radius;
	/* Gaussian: kernel_scale (exp(-gaussian_exponent d^2) - gaussian_floor); Lanczos: kernel_scale alone. */
	double gaussian_exponent, gaussian_floor, kernel_scale;
	double cubic_b, cubic_c; /* of the cubic filters; the others do not use them */
	double *xyz;
	uint8_t *touched_tiles; /* one per tile */
	struct chain_moments moments;
};

/* Returns -ENOMEM or -EINVAL, the latter also for a window that cuts off a part of a panorama into which kernels
 * reach from the other side. */
int film_sums_init(struct film_sums *f, const struct plan *p, const struct scene_settings *s, struct error *e);
void film_sums_fini(struct film_sums *f);
void film_sums_splat(struct film_sums *f, const struct splat *s, double weight);
/* Adds the touched tiles to the batch in row-major order, rounded to float. Returns -ENOMEM if out of memory. */
int film_sums_add_tiles(const struct film_sums *f, struct batch *out, struct error *e);

/* Returns the kernel's value at a distance from the pixel's centre, in one dimension. */
double film_sums_kernel(const struct film_sums *f, double distance);

#endif
