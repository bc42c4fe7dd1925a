/* SPDX-License-Identifier: Apache-2.0 */
/* Numbers are stored as the same bytes on every machine; a truncated file, or one with a changed bit, is refused. */
#include "common/base/checked_file.h"

#include "common/base/bytes.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/golden.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

static char path[128];
static struct error e;

static int set_up(void **state)
{
	int rc = temporary_folder_set_up(state);
	snprintf(path, sizeof path, "%s/file", temporary_folder);
	return rc;
}

/* "abc", two numbers of four bytes, one of eight, -2 as a double, 0.5 as a float, and the checksum. */
static const unsigned char file_bytes[] = {0x61, 0x62, 0x63, 0x04, 0x03, 0x02, 0x01, 0xfe, 0xff, 0xff, 0xff, 0x08,
					   0x07, 0x06, 0x05, 0x04, 0x03, 0x02, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00,
					   0x00, 0x00, 0xc0, 0x00, 0x00, 0x00, 0x3f, 0x10, 0xa3, 0xbc, 0xc4};

static void write_file(void)
{
	struct checked_file f;
	const uint32_t words[2] = {0x01020304, (uint32_t)-2};
	const uint64_t large = 0x0102030405060708;
	const double two = -2;
	const float half = 0.5f;
	assert_int_equal(checked_file_create(&f, path, &e), 0);
	assert_int_equal(checked_file_write(&f, "abc", 3, &e), 0);
	assert_int_equal(checked_file_write_numbers(&f, words, sizeof *words, 2, &e), 0);
	assert_int_equal(checked_file_write_numbers(&f, &large, sizeof large, 1, &e), 0);
	assert_int_equal(checked_file_write_numbers(&f, &two, sizeof two, 1, &e), 0);
	assert_int_equal(checked_file_write_numbers(&f, NULL, sizeof two, 0, &e), 0);
	assert_int_equal(checked_file_write_numbers(&f, &half, sizeof half, 1, &e), 0);
	assert_int_equal(checked_file_finish(&f, &e), 0);
	assert_int_equal(f.bytes_written, sizeof file_bytes);
}

static void numbers_have_fixed_bytes(void **state)
{
	(void)state;
	struct checked_file f;
	char text[3];
	uint32_t words[2];
	uint64_t large;
	double two;
	float half;
	write_file();
	golden_compare_file(path, file_bytes, sizeof file_bytes);
	assert_int_equal(checked_file_open(&f, path, &e), 0);
	assert_int_equal(f.remaining_bytes, sizeof file_bytes - 4);
	assert_int_equal(checked_file_read(&f, text, sizeof text, &e), 0);
	assert_int_equal(checked_file_read_numbers(&f, words, sizeof *words, 2, &e), 0);
	assert_int_equal(checked_file_read_numbers(&f, &large, sizeof large, 1, &e), 0);
	assert_int_equal(checked_file_read_numbers(&f, &two, sizeof two, 1, &e), 0);
	/* A read beyond the end of the file, or of more bytes than any file has, reads nothing. */
	half = 7;
	assert_int_equal(checked_file_read_numbers(&f, &two, sizeof two, 1, &e), -EBADMSG);
	assert_int_equal(checked_file_read_numbers(&f, &half, sizeof half, SIZE_MAX / 4 + 2, &e), -EBADMSG);
	assert_true(half == 7 && two == -2);
	assert_int_equal(checked_file_expect_end(&f, &e), -EBADMSG);
	assert_int_equal(checked_file_read_numbers(&f, &half, sizeof half, 1, &e), 0);
	assert_int_equal(checked_file_expect_end(&f, &e), 0);
	assert_true(memcmp(text, "abc", 3) == 0 && words[0] == 0x01020304 && words[1] == (uint32_t)-2);
	assert_true(large == 0x0102030405060708 && half == 0.5f);
	assert_int_equal(checked_file_read(&f, text, 1, &e), -EBADMSG);
	checked_file_close(&f);
}

static void damaged_files_are_refused(void **state)
{
	(void)state;
	struct checked_file f;
	for (size_t bit = 0; bit < 8 * sizeof file_bytes; bit++) {
		write_file();
		int fd = open(path, O_WRONLY);
		unsigned char changed = (unsigned char)(file_bytes[bit / 8] ^ 1 << bit % 8);
		assert_int_equal(pwrite(fd, &changed, 1, (off_t)(bit / 8)), 1);
		close(fd);
		assert_int_equal(checked_file_open(&f, path, &e), -EBADMSG);
	}
	for (size_t size = 0; size < sizeof file_bytes; size++) {
		write_file();
		assert_int_equal(truncate(path, (off_t)size), 0);
		assert_int_equal(checked_file_open(&f, path, &e), -EBADMSG);
	}
	write_file();
	FILE *more = fopen(path, "ab");
	assert_true(more && putc(1, more) == 1 && fclose(more) == 0);
	assert_int_equal(checked_file_open(&f, path, &e), -EBADMSG);
}

/* Arrays cross the edges of the buffer, at each distance from an edge. */
static void large_arrays_are_read_back(void **state)
{
	(void)state;
	enum { COUNT = 20000 };
	uint64_t *numbers = malloc(COUNT * sizeof *numbers), *back = malloc(COUNT * sizeof *back);
	assert_true(numbers && back);
	for (size_t i = 0; i < COUNT; i++)
		numbers[i] = i * UINT64_C(0x9e3779b97f4a7c15);
	for (size_t prefix_size = 0; prefix_size < 9; prefix_size++) {
		struct checked_file f;
		char text[8];
		assert_int_equal(checked_file_create(&f, path, &e), 0);
		assert_int_equal(checked_file_write(&f, "12345678", prefix_size, &e), 0);
		assert_int_equal(checked_file_write_numbers(&f, numbers, sizeof *numbers, COUNT, &e), 0);
		assert_int_equal(checked_file_write_numbers(&f, numbers, 4, 3, &e), 0);
		assert_int_equal(checked_file_finish(&f, &e), 0);
		assert_int_equal(f.bytes_written, prefix_size + COUNT * sizeof *numbers + 12 + 4);
		assert_int_equal(checked_file_open(&f, path, &e), 0);
		assert_int_equal(checked_file_read(&f, text, prefix_size, &e), 0);
		memset(back, 0, COUNT * sizeof *back);
		assert_int_equal(checked_file_read_numbers(&f, back, sizeof *back, COUNT, &e), 0);
		assert_memory_equal(back, numbers, COUNT * sizeof *back);
		assert_int_equal(f.remaining_bytes, 12);
		checked_file_close(&f);
	}
	free(numbers);
	free(back);
}

/* Reads and writes as a machine of the other byte order does. */
static void reverse_numbers_swaps_byte_order(void **state)
{
	(void)state;
	const unsigned char source[] = {1, 2, 3, 4, 5, 6, 7, 8};
	unsigned char target[8];
	reverse_bytes_of_numbers(target, source, 8, 1);
	assert_memory_equal(target, ((unsigned char[]){8, 7, 6, 5, 4, 3, 2, 1}), 8);
	reverse_bytes_of_numbers(target, source, 4, 2);
	assert_memory_equal(target, ((unsigned char[]){4, 3, 2, 1, 8, 7, 6, 5}), 8);
	reverse_bytes_of_numbers(target, target, 2, 4);
	assert_memory_equal(target, ((unsigned char[]){3, 4, 1, 2, 7, 8, 5, 6}), 8);
	reverse_bytes_of_numbers(target, source, 1, 8);
	assert_memory_equal(target, source, 8);
}

/* copy_numbers gives the bytes of put64, get64 and so on for each number, including signs of zeros and NaNs. */
static void copy_numbers_keeps_every_bit(void **state)
{
	(void)state;
	const double d[] = {-0.0, -NAN, 5e-324, INFINITY};
	const float f[] = {-0.0f, NAN, 1e-45f, -INFINITY};
	unsigned char single_bytes[32], bulk_bytes[32];
	double back[4];
	for (int i = 0; i < 4; i++)
		put_double(single_bytes + 8 * i, d[i]);
	copy_numbers(bulk_bytes, d, sizeof *d, 4);
	assert_memory_equal(single_bytes, bulk_bytes, 32);
	copy_numbers(back, bulk_bytes, sizeof *d, 4);
	assert_memory_equal(back, d, sizeof d);
	for (int i = 0; i < 4; i++)
		put_float(single_bytes + 4 * i, f[i]);
	copy_numbers(bulk_bytes, f, sizeof *f, 4);
	assert_memory_equal(single_bytes, bulk_bytes, 16);
	assert_true(get_float(bulk_bytes + 8) == f[2] && get_double(single_bytes) != 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(numbers_have_fixed_bytes, set_up, temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(damaged_files_are_refused, set_up, temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(large_arrays_are_read_back, set_up, temporary_folder_tear_down),
		cmocka_unit_test(reverse_numbers_swaps_byte_order),
		cmocka_unit_test(copy_numbers_keeps_every_bit),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
