/* SPDX-License-Identifier: Apache-2.0 */
/* Names: Mitsuba 0.6's camelCase in 3.x spelling, and what a mistyped one may have meant. Pure; any thread. */
#ifndef WORKER_RENDER_SCENE_SPELLING_H
#define WORKER_RENDER_SCENE_SPELLING_H

#include <stddef.h>

/* toWorld -> to_world, intIOR -> int_ior. out holds 2 * strlen(name) + 1 bytes. */
void spelling_snake(const char *name, char *out);

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
