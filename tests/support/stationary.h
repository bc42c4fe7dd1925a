/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Does a mutation leave the distribution of paths as it is? A test of one mutation alone, also of one forced (b, c), on
 * paths of given lengths.
 *
 * Paths are drawn in proportion to f, by resampling bdpt's bootstrap; each makes STATIONARY_STEPS mutations. Whatever
 * one looks at then has the same mean after the mutations as before, and only the difference is looked at: what makes
 * bdpt and plain chains noisy, where the paths are and what b is, is the same in both and cancels. The mean over the
 * steps is the image of a chain of which each STATIONARY_STEPS-th proposal is an independent one that is always
 * accepted: the bias found is the bias of that image.
 *
 * Looked at: four soft quarters of the film (bilinear, so that a step of some pixels is a small change), the shares of
 * X and Z of the whole image, and of some vertices place, slope of the half vector and cosine; geometry terms; point of
 * the aperture, wavelength. Groups are independent; by Student's t between them, level 1e-6 a case, shared by Holm's
 * method. Deterministic.
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

/* Faults planted in the acceptance, to see that they are found. */
enum stationary_fault { STATIONARY_SOUND, STATIONARY_NO_TRANSFER, STATIONARY_NO_DENSITY, STATIONARY_NO_GEOMETRY };

struct stationary_how {
	const char *mutation; /* "hslt@b2c0" */
	unsigned min_edges, max_edges;
	uint32_t starts, bootstrap; /* a group; divided by HSLT_TEST_SCALE */
	enum stationary_fault fault;
};

struct stationary_result {
	uint64_t starts, proposals, accepted;
	uint64_t counters[BATCH_COUNTERS];
	uint64_t strategy[STRATEGY_COUNTERS];
	uint64_t checked;						/* end states that path_check looked at */
	char failure[256];						/* of path_check, or the bootstrap; "": none */
	double bias[STATIONARY_FUNCTIONS], error[STATIONARY_FUNCTIONS]; /* of the mean; relative; 0: never changes */
	double least_block, least_colour,
		least_other; /* smallest bias found with 95 % probability: largest of their kind */
	int worst;	     /* the function that differs most */
	double p;	     /* of it, times the number of functions */
	double share;	     /* accepted mutations of accepted mutations and starts */
	double seconds;	     /* CPU */
};

/* Before runs on paths of given lengths: the bootstrap's roulette would leave few of the long ones. */
void stationary_keep_long_starts(struct world *w);

/* What mutations on paths of the same world and the same lengths may start from together: finding the starts takes a
 * third of the time of a mutation. Begins as zeros; the first run finds them, with its own seed. */
struct stationary_starts {
	uint64_t seed, *index; /* of the bootstrap, all groups after each other */
	double weight[STATIONARY_GROUPS];
};
void stationary_forget(struct stationary_starts *s);

/* As many starts and as long a bootstrap as in the run that found `from`. */
void stationary_run_from(const struct world *w, const char *test, const struct stationary_how *how,
			 struct stationary_starts *from, struct stationary_result *out);
void stationary_run(const struct world *w, const char *test, const struct stationary_how *how,
		    struct stationary_result *out);
const char *stationary_function(int i);
/* p above the level, no path that fails its check, nothing invalid. */
bool stationary_holds(const struct stationary_result *r);

#endif
