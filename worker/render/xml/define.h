/* SPDX-License-Identifier: Apache-2.0 */
/* The values of $name: those given on the command line and, for other names, those of <default>. One thread. */
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
	bool is_from_command_line, is_used;
};

struct define_table {
	struct arena *arena;
	struct define_entry *entries; /* DEFINE_MAX */
	size_t count, missing_count;
	bool is_incomplete; /* a file that may define more names is missing, so undefined names are not reported */
	const char *missing_names[DEFINE_MISSING_MAX]; /* names that are used but not defined, each once */
};

int define_init(struct define_table *t, const struct scene_define *defines, size_t count, struct arena *arena,
		struct error *e);
int define_add_default(struct define_table *t, const char *name, const char *value, struct error *e);
/* Records a <default> whose value uses an undefined name: uses of `name` are not reported as well. */
int define_add_valueless(struct define_table *t, const char *name, struct error *e);

/* Copies text into the arena with every $name replaced; values are not expanded again. The name is the longest run
 * of letters, digits and '_' after '$'; one that is not defined is kept if `keep_undefined` is set. Otherwise returns
 * -ENOENT with a message the first time, and -EEXIST if it was already reported or need not be. */
int define_substitute(struct define_table *t, const char *text, bool keep_undefined, size_t size_max, const char **out,
		      struct error *e);

/* Returns -EINVAL with a message if a name given on the command line was used by no file: it is taken for a mistake. */
int define_check_used(const struct define_table *t, struct error *e);

#endif
