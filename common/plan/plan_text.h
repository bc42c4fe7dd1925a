/* SPDX-License-Identifier: Apache-2.0 */
/* A plan as text: what was chosen and why, and the options that reproduce the same bits. */
#ifndef COMMON_PLAN_PLAN_TEXT_H
#define COMMON_PLAN_PLAN_TEXT_H

#include "common/plan/plan.h"

/* Describes a plan for logs: "hslt: 1024 chains in 16 groups, ...; 8 rounds (... mutations); ...". */
void plan_describe(const struct plan *p, char *text, size_t size);
/* Describes which numbers of the request plan_make changed ("chains 100 -> 128: ..."); empty if none. */
void plan_describe_changes(const struct plan_request *r, const struct plan *p, char *text, size_t size);
/* Prints the options that reproduce the bits after `rounds` rounds, whatever bound ended this job. */
void plan_print_options(const struct plan *p, uint64_t rounds, char *text, size_t size);

/* The options -D and --path, on which the contents of the scene depend. */
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
/* Like plan_print_options, followed by the options of `s`, quoted for a shell. */
void plan_print_options_with_scene(const struct plan *p, uint64_t rounds, const struct plan_scene *s, char *text,
				   size_t size);
enum { PLAN_OPTIONS_TEXT_MAX = 16384 }; /* bytes for the options; longer texts are cut */

#endif
