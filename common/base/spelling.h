/* SPDX-License-Identifier: Apache-2.0 */
/* What a mistyped name may have meant: of a scene's elements, of settings, of options. Pure; any thread. */
#ifndef COMMON_BASE_SPELLING_H
#define COMMON_BASE_SPELLING_H

#include <stddef.h>

/* Finds the nearest among the names offered; only one that is near enough to be a slip is kept. */
struct spelling {
	const char *wanted;
	const char *best; /* NULL: none is near */
	size_t distance;
};
void spelling_offer(struct spelling *s, const char *candidate);

/* "; did you mean `x`?" or "" */
const char *spelling_hint(const struct spelling *s, char *text, size_t size);

/* Appends `name` to a comma-separated list, which ends with "..." when there is no room. */
void spelling_list(char *text, size_t size, const char *name);

#endif
