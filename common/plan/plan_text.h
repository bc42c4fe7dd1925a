/* SPDX-License-Identifier: Apache-2.0 */
/* A plan as text: what was chosen and why, the options that reproduce the same bits, and texts inside a plan. */
#ifndef COMMON_PLAN_PLAN_TEXT_H
#define COMMON_PLAN_PLAN_TEXT_H

#include "common/plan/plan.h"

/* "1024 chains in 16 groups ..., 8 rounds ...": what was chosen, and by which rule; for logs. */
void plan_describe(const struct plan *p, char *text, size_t size);
/* What plan_make changed in the request ("chains 100 -> 128: ..."); empty: nothing. */
void plan_describe_changes(const struct plan_request *r, const struct plan *p, char *text, size_t size);
/* The options that reproduce the same bits after `rounds` rounds, whatever bound ended this job. */
void plan_options(const struct plan *p, uint64_t rounds, char *text, size_t size);

/* The options that say what the scene is: definitions and folders of its files. */
struct plan_define {
	const char *name, *value;
};
enum { PLAN_DEFINES_MAX = 256, PLAN_PATHS_MAX = 16 };
struct plan_scene {
	size_t define_count;
	struct plan_define defines[PLAN_DEFINES_MAX];
	size_t path_count;
	const char *paths[PLAN_PATHS_MAX];
};
/* plan_options with these, quoted for a shell. */
void plan_options_with(const struct plan *p, uint64_t rounds, const struct plan_scene *s, char *text, size_t size);
enum { PLAN_OPTIONS_TEXT = 16384 }; /* more is cut */

#endif
