/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A map of how bright an image is, from few samples: what fireflies made is spread over the place that they may have
 * come from.
 *
 * Contributions fall into a grid of cells, a few samples for each. From the whole film downwards a square is quartered
 * as long as each of its quarters knows its brightness well enough; where one does not, all four have that of the
 * square. So what a cell says never depends on whether a firefly happened to come. A hundredth of the mean is added in
 * squares, as in the relative error. One thread.
 */
#ifndef WORKER_RENDER_BRIGHTNESS_H
#define WORKER_RENDER_BRIGHTNESS_H

#include "worker/render/path/path.h"

struct brightness {
	struct film_window window;
	uint32_t across; /* cells along each side, a power of two */
	double *sum, *square, *scale;
};

/* Of so many samples; brightness_fini frees it. -ENOMEM */
int brightness_init(struct brightness *b, const struct film_window *window, uint64_t samples, struct error *e);
void brightness_fini(struct brightness *b);
void brightness_add(struct brightness *b, const struct splat *s);
/* All samples are there. */
void brightness_settle(struct brightness *b, uint64_t samples);
/* 1 / (pixels of the window x a pixel's X+Y+Z there): a contribution times this is relative to its place. 0: all is
 * black. */
double brightness_scale(const struct brightness *b, double x, double y);

#endif
