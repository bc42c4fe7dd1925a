/* SPDX-License-Identifier: Apache-2.0 */
/* The values of $name: from the command line, and from <default> where the command line says nothing. One thread. */
#ifndef WORKER_RENDER_XML_DEFINE_H
#define WORKER_RENDER_XML_DEFINE_H

#include "common/base/arena.h"
#include "common/base/error.h"

#include <stdbool.h>
#include <stddef.h>

struct scene_define {
	const char *name, *value; /* -D name=value */
};

enum { DEFINE_MAX = 1024, DEFINE_MISSING_MAX = 64 };

struct define_entry {
	const char *name, *value;
	bool given, used; /* given on the command line */
};

struct define_table {
	struct arena *arena;
	struct define_entry *entries; /* DEFINE_MAX */
	size_t count, missing_count;
	bool incomplete; /* a file that may define more is missing: undefined names are not reported */
	const char *missing[DEFINE_MISSING_MAX]; /* names that were used but not defined, each once */
};

int define_init(struct define_table *t, const struct scene_define *given, size_t count, struct arena *arena,
		struct error *e);
int define_default(struct define_table *t, const char *name, const char *value, struct error *e);
/* A <default> whose value uses an undefined name: uses of it are not reported again. */
int define_without_value(struct define_table *t, const char *name, struct error *e);

/* Replaces every $name in text; values are not expanded again. Returns text itself if it has no $. The longest run of
 * letters, digits and '_' after '$' must be a name, or is kept if `keep_unknown` is set. -ENOENT: no such name, asked
 * for the first time; -EEXIST: the same, already reported. */
int define_substitute(struct define_table *t, const char *text, bool keep_unknown, size_t size_max, const char **out,
		      struct error *e);

/* A name of the command line that no file had a use for is a mistake. */
int define_check_used(const struct define_table *t, struct error *e);

#endif
