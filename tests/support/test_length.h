/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The length of tests. By default all of them together take half an hour on two cores, each comparison with the power
 * that docs/design.md demands; FULL=1 adds the comparisons left out to save time; HSLT_TEST_SCALE=N takes N times fewer
 * samples and requires no power (sanitized runs: 20).
 */
#ifndef TESTS_SUPPORT_TEST_LENGTH_H
#define TESTS_SUPPORT_TEST_LENGTH_H

#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>

static inline bool test_is_full(void)
{
	const char *text = getenv("FULL");
	return text && atoi(text) > 0;
}

static inline uint32_t test_scale(void)
{
	const char *text = getenv("HSLT_TEST_SCALE");
	return text && atoi(text) > 1 ? (uint32_t)atoi(text) : 1;
}

static inline bool test_is_scaled(void)
{
	return test_scale() > 1;
}

#endif
