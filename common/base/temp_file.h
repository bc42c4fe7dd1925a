/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A temporary file that is removed if SIGINT, SIGTERM or SIGHUP ends the process; at most one at a time. The signal
 * then ends the process as usual. For programs with one thread that do not handle these signals themselves; an ignored
 * signal stays ignored.
 */
#ifndef COMMON_BASE_TEMP_FILE_H
#define COMMON_BASE_TEMP_FILE_H

#include "common/base/error.h"

/* Creates the file like mkstemp and returns its descriptor or -errno. The path must stay unchanged until
 * temp_file_end. */
int temp_file_begin(char *path, struct error *e);
/* Call once the file has been renamed or removed: signals no longer remove it. */
void temp_file_end(void);

#endif
