/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What went wrong outside, said once where the knowledge is.
 *
 * Functions that can fail because of the outside (a file, a peer, memory) return 0 or a negative errno and
 * write one sentence here. Any thread; allocates nothing.
 */
#ifndef COMMON_BASE_ERROR_H
#define COMMON_BASE_ERROR_H

#include <errno.h>

struct error {
	char text[1024];
};

/* Writes the sentence, clean as in text.h whatever is cut or quoted in it, and returns -errno_value. e may be NULL (the
 * code alone is wanted). */
__attribute__((format(printf, 3, 4))) int error_set(struct error *e, int errno_value, const char *format, ...);

/* Puts "prefix: " before the sentence that is there already. Returns code unchanged. */
__attribute__((format(printf, 3, 4))) int error_prefix(struct error *e, int code, const char *format, ...);

#endif
