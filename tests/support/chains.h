/* SPDX-License-Identifier: Apache-2.0 */
/* Chains of whole paths as a farm runs them, in one group: what they count, and the film that they leave. */
#ifndef TESTS_SUPPORT_CHAINS_H
#define TESTS_SUPPORT_CHAINS_H

#include "worker/render/render.h"
#include "worker/render/world/world.h"

struct chains_how {
	const char *mutations; /* NULL: what suits the scene */
	uint32_t min_depth, max_depth, chains;
	uint64_t bootstrap, steps; /* steps: of each chain */
	uint64_t seed;
	const uint64_t *seeds; /* NULL: by resampling; else one of the bootstrap for each chain */
};

struct chains_result {
	bool black;
	uint64_t counters[BATCH_COUNTERS], strategy[STRATEGY_COUNTERS];
	uint64_t film_invalid; /* values of the film that are not finite, or below 0 */
	uint64_t heaviest;     /* index of the bootstrap's largest weight */
	double heaviest_share; /* of all weights */
	double b, mean;	       /* of X + Y + Z over the film, in units of b */
	double quarter[4];
	float *xyz; /* film, malloc */
};

/* An error of the lease fails the test. */
void chains_run(const struct world *w, const struct chains_how *how, struct chains_result *out);

#endif
