/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Resolves a path that a program is told to write to. A regular file, or none, is replaced as a whole by renaming a
 * temporary file. For a link, the file it points to is replaced and the link stays. Anything else (a pipe, a terminal,
 * a device, a descriptor of the program itself such as /dev/stdout or /dev/fd/N) is written to. Any thread.
 */
#ifndef COMMON_BASE_TARGET_H
#define COMMON_BASE_TARGET_H

#include "common/base/error.h"

#include <stdbool.h>

enum { TARGET_PATH = 4096 };

struct target {
	char path[TARGET_PATH]; /* of the file to replace, or to write to */
	bool through;		/* write to it instead of replacing it */
	int descriptor;		/* in that case, the program's own descriptor; otherwise negative */
};

/* The file behind "-", back again for a command line, and what messages call it; other paths stay as they are. */
#define TARGET_STDOUT "/dev/stdout"
const char *target_of(const char *arg);
const char *target_arg(const char *path);
const char *target_shown(const char *path);

/* -ELOOP: a loop of links; -ENAMETOOLONG; -EISDIR. */
int target_find(struct target *t, const char *path, struct error *e);

/* Opens the target for writing and returns a new descriptor, or -errno. Opening a pipe waits for its reader. */
int target_open(const struct target *t, struct error *e);

#endif
