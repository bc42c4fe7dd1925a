/* SPDX-License-Identifier: Apache-2.0 */
#include "common/film/exact_sum.h"

#include <math.h>
#include <string.h>

enum { MANTISSA_BITS = 52, EXPONENT_MASK = 0x7ff, UNIT_EXPONENT = -1074 };

/* Adds value to word i and carries into the following words. */
static void add_word(struct exact_sum *s, int i, uint64_t value)
{
	while (value && i < EXACT_SUM_WORDS) {
		uint64_t previous = s->words[i];
		s->words[i] = previous + value;
		value = s->words[i] < previous;
		i++;
	}
}

static void subtract_word(struct exact_sum *s, int i, uint64_t value)
{
	while (value && i < EXACT_SUM_WORDS) {
		uint64_t previous = s->words[i];
		s->words[i] = previous - value;
		value = previous < value;
		i++;
	}
}

bool exact_sum_add(struct exact_sum *s, double x)
{
	uint64_t bits;
	memcpy(&bits, &x, sizeof bits);
	unsigned exponent = (unsigned)(bits >> MANTISSA_BITS) & EXPONENT_MASK;
	uint64_t mantissa = bits & ((UINT64_C(1) << MANTISSA_BITS) - 1);
	if (exponent == EXPONENT_MASK)
		return false;
	if (exponent)
		mantissa |= UINT64_C(1) << MANTISSA_BITS;
	else
		exponent = 1; /* subnormal */
	unsigned position = exponent - 1;
	int i = (int)(position / 64);
	unsigned shift = position % 64;
	uint64_t low = mantissa << shift, high = shift ? mantissa >> (64 - shift) : 0;
	if (bits >> 63) {
		subtract_word(s, i, low);
		subtract_word(s, i + 1, high);
	} else {
		add_word(s, i, low);
		add_word(s, i + 1, high);
	}
	return true;
}

void exact_sum_merge(struct exact_sum *s, const struct exact_sum *other)
{
	uint64_t carry = 0;
	for (int i = 0; i < EXACT_SUM_WORDS; i++) {
		uint64_t a = s->words[i] + carry;
		carry = a < carry;
		s->words[i] = a + other->words[i];
		carry += s->words[i] < a;
	}
}

static bool bit_at(const uint64_t *w, int position)
{
	return w[position / 64] >> (position % 64) & 1;
}

/* Returns whether any bit below the position is set. */
static bool any_below(const uint64_t *w, int position)
{
	for (int i = 0; i < position / 64; i++)
		if (w[i])
			return true;
	return (w[position / 64] & ((UINT64_C(1) << (position % 64)) - 1)) != 0;
}

double exact_sum_value(const struct exact_sum *s)
{
	struct exact_sum m = *s;
	bool negative = s->words[EXACT_SUM_WORDS - 1] >> 63;
	if (negative) {
		for (int i = 0; i < EXACT_SUM_WORDS; i++)
			m.words[i] = ~m.words[i];
		add_word(&m, 0, 1);
	}
	int top = EXACT_SUM_WORDS - 1;
	while (top > 0 && m.words[top] == 0)
		top--;
	if (m.words[top] == 0)
		return 0;
	int highest = top * 64 + 63 - __builtin_clzll(m.words[top]);
	double magnitude;
	if (highest <= MANTISSA_BITS) {
		magnitude = ldexp((double)m.words[0], UNIT_EXPONENT);
	} else {
		int lowest = highest - MANTISSA_BITS;
		uint64_t mantissa = 0;
		for (int b = highest; b >= lowest; b--)
			mantissa = mantissa << 1 | bit_at(m.words, b);
		bool half = bit_at(m.words, lowest - 1);
		if (half && ((mantissa & 1) || any_below(m.words, lowest - 1)))
			mantissa++;
		magnitude = ldexp((double)mantissa, lowest + UNIT_EXPONENT);
	}
	return negative ? -magnitude : magnitude;
}
