/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Does a mutation leave the distribution of paths unchanged? Tests a single mutation, possibly forced to (b, c), on
 * paths of given lengths.
 *
 * Paths are drawn in proportion to f, by resampling bdpt's bootstrap, and each makes STATIONARY_STEPS mutations. Any
 * function then has the same mean after the mutations as before, and only the difference is tested: the positions of
 * the paths and the value of b, which make bdpt and plain chains noisy, are the same in both and cancel. The mean over
 * the steps is the image of a chain of which every STATIONARY_STEPS-th proposal is an independent one that is always
 * accepted, so the bias found is the bias of that image.
 *
 * The functions are: four soft quarters of the film (bilinear, so that a step of some pixels is a small change); the
 * fractions of X and Z of the whole image; for some vertices the position, the slope of the half vector and the cosine;
 * geometry terms; the point on the aperture; the wavelength. Groups are independent; Student's t between them, at level
 * 1e-6 per case, shared by Holm's method. Deterministic.
 */
#ifndef TESTS_SUPPORT_STATIONARY_H
#define TESTS_SUPPORT_STATIONARY_H

#include "worker/render/render.h"
#include "worker/render/world/world.h"

enum {
	STATIONARY_STEPS = 20,
	STATIONARY_GROUPS = 64,
	STATIONARY_FUNCTIONS = 33,
	STATIONARY_BLOCKS = 4,
	STATIONARY_COLOURS = 2
};

/* Faults planted in the acceptance probability, to see that they are found. */
enum stationary_fault { STATIONARY_NO_FAULT, STATIONARY_NO_TRANSFER, STATIONARY_NO_DENSITY, STATIONARY_NO_GEOMETRY };

struct stationary_options {
	const char *mutation; /* "hslt@b2c0" */
	unsigned min_edges, max_edges;
	uint32_t starts, bootstrap; /* per group; divided by HSLT_TEST_SCALE */
	enum stationary_fault fault;
};

struct stationary_result {
	uint64_t starts, proposals, accepted;
	uint64_t counters[BATCH_COUNTERS];
	uint64_t strategy[STRATEGY_COUNTERS];
	uint64_t checked_states; /* number of final states examined by path_check */
	char failure[256];	 /* message of path_check or the bootstrap; "": none */
	double bias[STATIONARY_FUNCTIONS], error[STATIONARY_FUNCTIONS]; /* of the mean; relative; 0: never changes */
	double detectable_block_bias, detectable_colour_bias,
		detectable_other_bias; /* smallest bias found with 95 % probability: the largest for each kind of
					  function */
	int worst_function;	       /* the function that differs most */
	double p;		       /* p of that function, times the number of functions */
	double accepted_share;	       /* accepted mutations as a fraction of accepted mutations and starts */
	double cpu_seconds;
};

/* Call before runs on paths of given lengths: otherwise the bootstrap's roulette would leave few long paths. */
void stationary_disable_roulette(struct world *w);

/* Common starts of several mutations on paths of the same world and the same lengths: finding starts takes a third
 * of the time of a mutation. Initialize with zeros; the first run finds the starts, with its own seed. */
struct stationary_starts {
	uint64_t seed, *indices; /* indices in the bootstrap, for all groups in turn */
	double weight[STATIONARY_GROUPS];
};
void stationary_starts_fini(struct stationary_starts *s);

/* Needs as many starts and as long a bootstrap as the run that found `starts_cache`. */
void stationary_run_with_starts(const struct world *w, const char *test, const struct stationary_options *options,
				struct stationary_starts *starts_cache, struct stationary_result *out);
void stationary_run(const struct world *w, const char *test, const struct stationary_options *options,
		    struct stationary_result *out);
const char *stationary_function_name(int i);
/* Returns whether p is above the level, no path failed its check, and nothing was invalid. */
bool stationary_passes(const struct stationary_result *r);

#endif
