/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The error of an operation that involves the outside world (a file, a peer, memory).
 *
 * Functions that can fail return 0 or a negative errno. The function that detects an error writes one sentence for the
 * user into a struct error. Any thread; allocates nothing.
 */
#ifndef COMMON_BASE_ERROR_H
#define COMMON_BASE_ERROR_H

#include <errno.h>

struct error {
	char text[1024];
};

/* Writes the sentence, sanitised as in text.h, and returns -errno_value. e may be NULL if only the code is wanted. */
__attribute__((format(printf, 3, 4))) int error_set(struct error *e, int errno_value, const char *format, ...);

/* Sets "PATH: " followed by the system's text for errno_value; returns -errno_value. */
int error_file(struct error *e, int errno_value, const char *path);

/* Puts "prefix: " in front of the sentence. Returns code. */
__attribute__((format(printf, 3, 4))) int error_prefix(struct error *e, int code, const char *format, ...);

#endif
