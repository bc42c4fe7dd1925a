/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/golden.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdio.h>
#include <string.h>

void golden_fill(const struct golden_run *runs, size_t count, unsigned char *bytes, size_t size)
{
	memset(bytes, 0, size);
	for (size_t i = 0; i < count; i++) {
		size_t n = strlen(runs[i].hex) / 2;
		assert_true(runs[i].offset <= size && n <= size - runs[i].offset);
		for (size_t k = 0; k < n; k++) {
			unsigned byte;
			assert_int_equal(sscanf(runs[i].hex + 2 * k, "%2x", &byte), 1);
			bytes[runs[i].offset + k] = (unsigned char)byte;
		}
	}
}

void golden_compare_file(const char *path, const unsigned char *bytes, size_t size)
{
	FILE *f = fopen(path, "rb");
	assert_non_null(f);
	for (size_t i = 0; i < size; i++) {
		int byte = getc(f);
		if (byte != bytes[i])
			fail_msg("%s: byte %zu is %d where it was %d", path, i, byte, bytes[i]);
	}
	assert_int_equal(getc(f), EOF);
	fclose(f);
}

void golden_write_and_open(struct checked_file *f, const char *path, const unsigned char *bytes, size_t size)
{
	struct error e;
	assert_int_equal(checked_file_create(f, path, &e), 0);
	assert_int_equal(checked_file_write(f, bytes, size, &e), 0);
	assert_int_equal(checked_file_finish(f, &e), 0);
	assert_int_equal(checked_file_open(f, path, &e), 0);
}
