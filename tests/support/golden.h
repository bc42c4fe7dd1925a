/* SPDX-License-Identifier: Apache-2.0 */
/* Files as earlier builds wrote them, kept in tests as the runs of their bytes that are not zero. */
#ifndef TESTS_SUPPORT_GOLDEN_H
#define TESTS_SUPPORT_GOLDEN_H

#include "common/base/checked_file.h"

#include <stddef.h>

struct golden {
	size_t at;
	const char *hex;
};

/* Fills `size` bytes with these runs, and zeros between them. */
void golden_fill(const struct golden *runs, size_t count, unsigned char *bytes, size_t size);
/* Fails where a file first differs from these bytes. */
void golden_compare(const char *path, const unsigned char *bytes, size_t size);

/* Writes a file whose checksum fits, whatever is in it, and opens it. */
void golden_open(struct checked_file *f, const char *path, const unsigned char *bytes, size_t size);

#endif
