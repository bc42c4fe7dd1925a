/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Resolves the path of an output file. A regular file, or a new one, is to be replaced as a whole by renaming a
 * temporary file; for a link, the file that it points to is replaced and the link stays. Anything else (a pipe, a
 * terminal, a device, or a descriptor of the program itself such as /dev/stdout or /dev/fd/N) is to be written to
 * directly. Any thread.
 */
#ifndef COMMON_BASE_TARGET_H
#define COMMON_BASE_TARGET_H

#include "common/base/error.h"

#include <stdbool.h>

enum { TARGET_PATH_MAX = 4096 };

struct target {
	char path[TARGET_PATH_MAX]; /* the file to replace, or to write to */
	bool write_directly;	    /* write to it instead of replacing it */
	int descriptor;		    /* the program's own descriptor that path stands for; negative: none */
};

/* On the command line, "-" stands for stdout. These functions return other names unchanged. */
#define TARGET_STDOUT "/dev/stdout"
const char *target_from_arg(const char *arg);	   /* "-" to TARGET_STDOUT */
const char *target_to_arg(const char *path);	   /* TARGET_STDOUT to "-", for a command line */
const char *target_display_name(const char *path); /* TARGET_STDOUT to "stdout", for messages */

/* Follows links from `path` and decides how to write to the file at their end. A file that cannot be examined is no
 * error yet: writing to it will fail. Returns 0, -ELOOP for a loop of links, -ENAMETOOLONG, -EISDIR, or another -errno
 * of reading a link. */
int target_resolve(struct target *t, const char *path, struct error *e);

/* Opens a target whose `write_directly` is set. Returns a new descriptor or -errno. Opening a pipe waits for its
 * reader. */
int target_open(const struct target *t, struct error *e);

#endif
