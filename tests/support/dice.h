/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Random numbers and sample counts for tests: a stream of the counter-based generator, seeded by the test's name, so
 * that every run is the same. HSLT_TEST_SCALE divides counts (sanitized runs), FULL=1 multiplies them by 8.
 */
#ifndef TESTS_SUPPORT_DICE_H
#define TESTS_SUPPORT_DICE_H

#include "worker/render/math/vec3.h"

#include <stddef.h>
#include <stdint.h>

struct dice {
	uint64_t seed, index;
	double value[4];
	unsigned remaining;
};

struct dice dice_for_test(const char *test);
double dice_uniform(struct dice *d); /* in [0,1) */
double dice_between(struct dice *d, double low, double high);
uint32_t dice_below(struct dice *d, uint32_t n); /* 0 .. n-1 */
vec3 dice_direction(struct dice *d);		 /* uniform on the sphere */
double dice_normal(struct dice *d);		 /* mean 0, variance 1 */
double dice_poisson(struct dice *d, double mean);

size_t dice_scaled_count(size_t samples); /* scaled by the environment, at least 1 */

#endif
