/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Do two integrators make the same image? (docs/design.md, rules 7.) Each side is rendered as 16 or more independent
 * groups, with a seed of its own; blocks of the image and the mean are compared by Welch's t between the groups' means.
 *
 * Level: 1e-4 over all tests of the suite, shared equally among comparisons and by Holm's method within one. Power: the
 * smallest bias that is found with 95 % probability is printed. The test fails if it is more than 2 % for a block or
 * 0.5 % for the mean, or if a planted bias of twice that size is not found.
 */
#ifndef TESTS_SUPPORT_AGREEMENT_H
#define TESTS_SUPPORT_AGREEMENT_H

#include "worker/render/render.h"
#include "worker/render/world/world.h"

enum {
	AGREEMENT_BLOCKS = 2,
	AGREEMENT_CELLS = AGREEMENT_BLOCKS * AGREEMENT_BLOCKS,
	AGREEMENT_GROUPS_MAX = 64,
	AGREEMENT_BOOTSTRAP = 2048
};

struct agreement_options {
	const char *integrator;
	uint64_t spp;
	uint32_t groups;	       /* 16..64 */
	uint32_t min_depth, max_depth; /* 0: min_depth 1, and the scene's max_depth */
};

/* Per group: the mean of X+Y+Z over each block, then over the whole film. */
struct agreement_image {
	uint32_t groups;
	double mean[AGREEMENT_GROUPS_MAX][AGREEMENT_CELLS + 1];
	uint64_t counters[BATCH_COUNTERS];
	uint64_t strategy[BATCH_STRATEGIES][STRATEGY_COUNTERS];
};

void agreement_render(const struct world *w, const char *test, const char *side,
		      const struct agreement_options *options, struct agreement_image *out);

/* Like agreement_render(), with `bootstrap` independent paths in each group of chains instead of AGREEMENT_BOOTSTRAP,
 * and with a mixture of strategies (NULL: the default one). */
void agreement_render_with_mutations(const struct world *w, const char *test, const char *side,
				     const struct agreement_options *options, uint64_t bootstrap, const char *mutations,
				     struct agreement_image *out);

/* Fails the test if the images differ, or if the comparison is too weak to tell. */
void agreement_check(const char *test, const struct agreement_image *a, const struct agreement_image *b);

/* Like agreement_check(), but the power is only printed, not required: for whole scenes that cannot be rendered to half
 * a percent in a test. Returns the relative difference of the means. */
double agreement_check_any_power(const char *test, const struct agreement_image *a, const struct agreement_image *b);

/* The result of the comparison as numbers, for tables: of the means, and of the block that differs most. */
struct agreement_difference {
	double mean, error; /* a's mean minus b's, and its standard error, both relative to b's mean */
	double detectable_bias, detectable_block_bias; /* smallest bias of the mean, and of any block, that is found
							  with 95 % probability */
	bool agrees;
};
void agreement_measure(const struct agreement_image *a, const struct agreement_image *b,
		       struct agreement_difference *out);

/* Fails unless the mean of every cell is `expected` (same level and power, one-sample t). */
void agreement_check_constant(const char *test, const struct agreement_image *a, double expected);

#endif
