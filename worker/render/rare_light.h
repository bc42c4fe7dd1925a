/* SPDX-License-Identifier: Apache-2.0 */
/*
 * How much of the light `bdpt` brings in rare contributions of many times the brightness of their place, whether or not
 * a sample met them: by merging (worker/render/path/merging.h), which finds that light at once. One thread.
 */
#ifndef WORKER_RENDER_RARE_LIGHT_H
#define WORKER_RENDER_RARE_LIGHT_H

#include "worker/render/path/brightness.h"

/* Contributions beyond this many times the brightness of their place. */
#define RENDER_RARE 32

struct rare_light {
	double share; /* share of the film's light, 0 to 1 except for noise */
	double seen;  /* share of all light that photons bring to what the camera sees */
};

/* Traces as many sub-paths from both ends as `samples`, with numbers of RNG_CHOICE, two steps from `step` on. Ticks.
 * -ENOMEM */
int rare_light(struct path_context *c, const struct brightness *map, uint64_t seed, uint64_t step, uint64_t samples,
	       struct rare_light *out);

#endif
