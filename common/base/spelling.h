/* SPDX-License-Identifier: Apache-2.0 */
/* Finds what a mistyped name may have meant. Pure; any thread. */
#ifndef COMMON_BASE_SPELLING_H
#define COMMON_BASE_SPELLING_H

#include <stddef.h>

enum { SPELLING_MOST = 48 }; /* longer names are not compared */

/* Keeps the nearest of the offered names, if it is near enough to be a typing error. Not to be copied. */
struct spelling {
	const char *wanted;
	const char *best; /* NULL: none is near enough; otherwise `copy`, so that an offered name need not last */
	size_t distance;
	char copy[SPELLING_MOST + 1];
};
void spelling_offer(struct spelling *s, const char *candidate);

/* "; did you mean `x`?" or "" */
const char *spelling_hint(const struct spelling *s, char *text, size_t size);

/* Appends `name` to a comma-separated list, which ends with "..." if it is full. */
void spelling_list(char *text, size_t size, const char *name);

#endif
