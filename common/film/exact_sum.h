/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A sum of doubles without rounding, and therefore independent of the order: a Kulisch accumulator, 64-bit words that
 * cover the whole range of double. Infinities and NaN are refused. No allocation.
 */
#ifndef COMMON_FILM_EXACT_SUM_H
#define COMMON_FILM_EXACT_SUM_H

#include <stdbool.h>
#include <stdint.h>

enum { EXACT_SUM_WORDS = 36 };

struct exact_sum {
	uint64_t words[EXACT_SUM_WORDS]; /* two's complement, least significant first, unit 2^-1074 */
};

bool exact_sum_add(struct exact_sum *s, double x); /* false, and no change, if x is not finite */
void exact_sum_merge(struct exact_sum *s, const struct exact_sum *other);
double exact_sum_value(const struct exact_sum *s); /* rounded once, to nearest even */

#endif
