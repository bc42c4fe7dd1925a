/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A map of an image's brightness from few samples. Fireflies are spread over the region that they may have come from.
 *
 * Contributions fall into a grid of cells, a few samples in each. Starting with the whole film, a square is divided as
 * long as the brightness of each of its quarters is known well enough; otherwise all four get the brightness of the
 * square. So the value of a cell does not depend on whether a firefly happened to land in it. A hundredth of the mean
 * is added in squares, as in the relative error. One thread.
 */
#ifndef WORKER_RENDER_PATH_BRIGHTNESS_H
#define WORKER_RENDER_PATH_BRIGHTNESS_H

#include "worker/render/path/path.h"

enum { BRIGHTNESS_A_CELL = 8 }; /* samples of path or bdpt for a cell */

struct brightness {
	struct splat_target target; /* for weights over the window's pixels, as films have them */
	struct film_window window;
	uint32_t across; /* cells along each side, a power of two */
	double *sum, *square, *scale;
	double *now;	   /* what the present sample has added */
	uint32_t *touched; /* the cells in which that is not 0 */
	size_t touched_count;
};

/* Makes the map from that many samples of the whole window by `trace`, with the numbers of a stream and step;
 * brightness_fini frees it. Ticks. -ENOMEM */
int brightness_of_samples(struct brightness *b, struct path_context *c, path_tracer *trace, uint64_t seed,
			  enum rng_stream stream, uint64_t step, uint64_t samples, struct error *e);

/* The same in steps: for a map of that many samples, at least `a_cell` to a cell; brightness_fini frees it. -ENOMEM */
int brightness_init(struct brightness *b, const struct film_window *window, uint64_t samples, unsigned a_cell,
		    struct error *e);
void brightness_fini(struct brightness *b);
/* What a sample contributes, times a weight. All that it contributes to a cell counts as one. */
void brightness_add(struct brightness *b, const struct splat *s, double weight);
void brightness_end_sample(struct brightness *b);
/* What the sample itself contributes, and its end. */
void brightness_add_sample(struct brightness *b, const struct path_sample *sample);
/* Call one of these when all samples have been added. */
void brightness_settle(struct brightness *b, uint64_t samples);
/* For samples whose fireflies are spread by chains: a cell has the mean of its neighbourhood, which is wider where less
 * is known. This keeps dark places beside bright ones apart, which squares of the whole film do not. */
void brightness_settle_near(struct brightness *b, uint64_t samples);
/* 1 / (pixels of the window x a pixel's X+Y+Z there): multiplies a contribution to make it relative to the
 * brightness of its place. 0: everything is black. */
double brightness_scale(const struct brightness *b, double x, double y);

#endif
