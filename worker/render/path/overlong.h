/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The energy of paths that are longer than an integrator simulates, so that an image can state
 * how much of it is missing.
 */
#ifndef WORKER_RENDER_PATH_OVERLONG_H
#define WORKER_RENDER_PATH_OVERLONG_H

#include "worker/render/path/path.h"

enum { OVERLONG_EDGES_MAX = 4096 }; /* taken as unlimited */

/* Returns one sample of the energy, measured as path_sample.intensity, in paths of more than c->max_depth, at least
 * c->min_depth and at most `max_edges` edges. Its random numbers are those of the stream RNG_OVERLONG_PATH with this
 * index. c is restored except for its sub-paths and counters; `scratch` is overwritten. Does not allocate. */
double overlong_paths_sample_energy(struct path_context *c, uint64_t seed, uint64_t index, uint32_t max_edges,
				    struct path_sample *scratch);

#endif
