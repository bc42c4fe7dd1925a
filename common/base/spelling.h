/* SPDX-License-Identifier: Apache-2.0 */
/* Finds the known name that a mistyped name was probably meant to be. Pure; any thread. */
#ifndef COMMON_BASE_SPELLING_H
#define COMMON_BASE_SPELLING_H

#include <stddef.h>

enum { SPELLING_NAME_MAX = 48 }; /* longer names are not compared */

/* Keeps the nearest of the candidates that are near enough to `wanted_name` for a typing error. Set `wanted_name`, zero
 * the rest. Must not be copied, because `best_match` points into it. */
struct spelling {
	const char *wanted_name;
	const char *best_match;		  /* the nearest candidate, in `copy`; NULL: none is near enough */
	size_t best_distance;		  /* its edit distance */
	char copy[SPELLING_NAME_MAX + 1]; /* so that candidates need not outlive spelling_offer */
};
void spelling_offer(struct spelling *s, const char *candidate);

/* Prints "; did you mean `x`?", or "" if no candidate was near enough. Returns text. */
const char *spelling_hint(const struct spelling *s, char *text, size_t size);

/* Appends `name` to a comma-separated list in text, or "..." if the list is full. */
void spelling_append_to_list(char *text, size_t size, const char *name);

#endif
