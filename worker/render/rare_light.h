/* SPDX-License-Identifier: Apache-2.0 */
/*
 * How much of the light comes to `bdpt` in rare contributions of many times the brightness of their place,
 * whether or not a sample found them. It is estimated by merging (worker/render/path/merging.h), which finds that
 * light at once. One thread.
 */
#ifndef WORKER_RENDER_RARE_LIGHT_H
#define WORKER_RENDER_RARE_LIGHT_H

#include "worker/render/path/brightness.h"

/* Contributions are rare if they exceed the brightness of their place by this factor. */
#define RENDER_RARE_FACTOR 32

struct rare_light {
	double rare_share; /* rare share of the film's light; 0 to 1 except for noise */
	double seen_share; /* share of all light that photons bring to what the camera sees */
};

/* Traces `samples` sub-paths from each end, with numbers of RNG_CHOICE, for which it uses `step` and the next step.
 * Ticks. Returns -ENOMEM if out of memory. */
int rare_light_estimate(struct path_context *c, const struct brightness *map, uint64_t seed, uint64_t step,
			uint64_t samples, struct rare_light *out);

#endif
