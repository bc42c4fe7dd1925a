/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A map of an image's brightness, made from few samples. A firefly is spread over the region
 * from which it may have come.
 *
 * Contributions are summed in a grid of cells with a few samples each. Starting with the whole film, a square is
 * subdivided as long as the brightness of all four quarters is known well enough; otherwise all four get the brightness
 * of the square. So the value of a cell does not depend on whether a firefly happened to land in it. One percent of the
 * mean brightness is added in quadrature, as in the relative error. One thread.
 */
#ifndef WORKER_RENDER_PATH_BRIGHTNESS_H
#define WORKER_RENDER_PATH_BRIGHTNESS_H

#include "worker/render/path/path.h"

enum { BRIGHTNESS_SAMPLES_PER_CELL = 8 }; /* samples of path or bdpt per cell */

struct brightness {
	/* Adds splats whose weight is relative to the number of pixels of the window, as films get them. */
	struct splat_target target;
	struct film_window window;
	uint32_t resolution; /* cells along each side; a power of two */
	double *sum, *square_sum, *scale;
	double *current;   /* contributions of the current sample to each cell */
	uint32_t *touched; /* the cells where `current` is not 0 */
	size_t touched_count;
};

/* Makes the map from `samples` samples of the whole window, evaluated by `trace` with the numbers of the given stream
 * and step; brightness_fini frees it. Calls liveness_tick(). Returns -ENOMEM if out of memory. */
int brightness_init_from_samples(struct brightness *b, struct path_context *c, path_tracer *trace, uint64_t seed,
				 enum rng_stream stream, uint64_t step, uint64_t samples, struct error *e);

/* To make a map step by step: brightness_init prepares a map for that many samples, at least `samples_per_cell` per
 * cell, and returns -ENOMEM if out of memory. brightness_fini frees it. */
int brightness_init(struct brightness *b, const struct film_window *window, uint64_t samples, unsigned samples_per_cell,
		    struct error *e);
void brightness_fini(struct brightness *b);
/* Adds a splat of the current sample, times a weight. All splats of a sample in one cell count as one. */
void brightness_add(struct brightness *b, const struct splat *s, double weight);
void brightness_end_sample(struct brightness *b);
/* Adds all splats of a sample and ends it. */
void brightness_add_sample(struct brightness *b, const struct path_sample *sample);
/* Computes the scales; call either this or brightness_compute_nearby_scales when all samples have been added. */
void brightness_compute_scales(struct brightness *b, uint64_t samples);
/* For samples whose fireflies are spread by chains: a cell gets the mean of its neighbourhood, which is wider where
 * less is known. Unlike squares of the whole film, this keeps dark places next to bright ones apart. */
void brightness_compute_nearby_scales(struct brightness *b, uint64_t samples);
/* Returns 1 / (pixels of the window x X+Y+Z of a pixel at this place), which makes a contribution relative to the
 * brightness of its place. 0 if everything is black. */
double brightness_inverse_at(const struct brightness *b, double x, double y);

#endif
