/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Where a path leads that a program is told to write to. A regular file, or none, is replaced as a whole: what is
 * written beside it takes its name. Of a link the file that it leads to is replaced, and the link stays. Anything else,
 * a pipe, a terminal, a device, a descriptor of the program itself (/dev/stdout, /dev/fd/N), is written to and stays
 * what it is. Any thread.
 */
#ifndef COMMON_BASE_TARGET_H
#define COMMON_BASE_TARGET_H

#include "common/base/error.h"

#include <stdbool.h>

enum { TARGET_PATH = 4096 };

struct target {
	char path[TARGET_PATH]; /* of the file to be replaced, or to be written to */
	bool through;		/* it is written to */
	int descriptor;		/* then, of this program: which; else negative */
};

/* -ELOOP: links that lead nowhere; -ENAMETOOLONG; -EISDIR. */
int target_find(struct target *t, const char *path, struct error *e);

/* Of one that is written to: a descriptor of its own; a pipe waits for its reader. -errno. */
int target_open(const struct target *t, struct error *e);

#endif
