/* SPDX-License-Identifier: Apache-2.0 */
/* Files written by earlier versions, stored in tests as the runs of their non-zero bytes. */
#ifndef TESTS_SUPPORT_GOLDEN_H
#define TESTS_SUPPORT_GOLDEN_H

#include "common/base/checked_file.h"

#include <stddef.h>

struct golden_run {
	size_t offset;
	const char *hex;
};

/* Fills `size` bytes with these runs, and with zeros between them. */
void golden_fill(const struct golden_run *runs, size_t count, unsigned char *bytes, size_t size);
/* Fails at the first byte of the file that differs from these bytes. */
void golden_compare_file(const char *path, const unsigned char *bytes, size_t size);

/* Writes a file with a valid checksum, whatever its contents, and opens it. */
void golden_write_and_open(struct checked_file *f, const char *path, const unsigned char *bytes, size_t size);

#endif
