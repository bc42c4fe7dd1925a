/* SPDX-License-Identifier: Apache-2.0 */
/* Chains of whole paths run in one group, as by a farm: their counters, and their film. */
#ifndef TESTS_SUPPORT_CHAINS_H
#define TESTS_SUPPORT_CHAINS_H

#include "worker/render/render.h"
#include "worker/render/world/world.h"

struct chains_options {
	const char *mutations; /* NULL: the default mixture for the scene */
	uint32_t min_depth, max_depth, chains;
	uint64_t bootstrap, steps; /* steps: of each chain */
	uint64_t seed;
	const uint64_t *seeds; /* NULL: starts are resampled; otherwise the index in the bootstrap for each chain */
};

struct chains_result {
	bool is_black;
	uint64_t counters[BATCH_COUNTERS], strategy[STRATEGY_COUNTERS];
	uint64_t invalid_film_values; /* number of film values that are not finite, or below 0 */
	uint64_t heaviest_index;      /* index of the bootstrap's largest weight */
	double heaviest_share;	      /* its fraction of the sum of all weights */
	double normalization, mean;   /* mean: of X + Y + Z over the film, in units of `normalization` */
	double quarter_means[4];
	float *xyz; /* the film, allocated with malloc() */
};

/* Fails the test if the lease fails. */
void chains_run(const struct world *w, const struct chains_options *options, struct chains_result *out);

#endif
