/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Resolves the path of an output file. A regular file, or a new one, is to be replaced as a whole by renaming a
 * temporary file; for a link, the file that it points to is replaced and the link stays. Anything else (a pipe, a
 * terminal, a device, or a descriptor of the program itself such as /dev/stdout or /dev/fd/N) is to be written to
 * directly. Any thread.
 */
#ifndef COMMON_BASE_OUTPUT_TARGET_H
#define COMMON_BASE_OUTPUT_TARGET_H

#include "common/base/error.h"

#include <stdbool.h>

enum { OUTPUT_TARGET_PATH_MAX = 4096 };

struct output_target {
	char path[OUTPUT_TARGET_PATH_MAX]; /* the file to replace, or to write to */
	bool writes_directly;		   /* write to it instead of replacing it */
	int fd;				   /* the program's own descriptor that path stands for; negative: none */
};

/* On the command line, "-" stands for stdout. These functions return other names unchanged. */
#define TARGET_STDOUT "/dev/stdout"
const char *output_target_from_arg(const char *arg);	  /* "-" to TARGET_STDOUT */
const char *output_target_to_arg(const char *path);	  /* TARGET_STDOUT to "-", for a command line */
const char *output_target_display_name(const char *path); /* TARGET_STDOUT to "stdout", for messages */

/* Follows links from `path` and decides how to write to the file at their end. A file that cannot be examined is no
 * error yet: writing to it will fail. Returns 0, -ELOOP for a loop of links, -ENAMETOOLONG, -EISDIR, or another -errno
 * of reading a link. */
int output_target_resolve(struct output_target *t, const char *path, struct error *e);

/* Opens a target whose `writes_directly` is set. Returns a new descriptor or -errno. Opening a pipe waits for its
 * reader. */
int output_target_open(const struct output_target *t, struct error *e);

#endif
