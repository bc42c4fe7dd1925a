/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A store of many small files makes room in steps whose time does not grow with the number of its files: a write evicts
 * as many files as its bytes have blocks on the disk, without looking at the others. The file that was used or released
 * last is evicted last.
 */
#include "common/base/disk.h"
#include "common/blob/blob.h"
#include "common/blob/blob_state.h"
#include "tests/support/temporary_folder.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

enum { FEW = 4000, MANY = 60000, SIZE = 10, CHUNK = 1 << 20 };

static double user_seconds(void)
{
	struct rusage u;
	getrusage(RUSAGE_SELF, &u);
	return (double)u.ru_utime.tv_sec + 1e-6 * (double)u.ru_utime.tv_usec;
}

static struct blob_hash hash_of_number(unsigned i)
{
	struct blob_hash h = {{0}};
	uint32_t mixed = i * UINT32_C(2654435761); /* so that they are not in order */
	memcpy(h.bytes, &mixed, sizeof mixed);
	return h;
}

/* A store whose files' contents do not match their names; nobody compares these. */
static struct blob_store *make_store(unsigned count, uint64_t limit)
{
	struct blob_store *s;
	struct error e;
	for (unsigned i = 0; i < count; i++) {
		char hex[BLOB_HEX_SIZE], path[4096];
		struct blob_hash h = hash_of_number(i);
		blob_hash_to_hex(&h, hex);
		snprintf(path, sizeof path, "%s/%s", temporary_folder, hex);
		int fd = open(path, O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
		assert_true(fd >= 0);
		assert_int_equal(write(fd, "0123456789", SIZE), SIZE);
		close(fd);
	}
	assert_int_equal(blob_store_open(&s, temporary_folder, limit, &e), 0);
	return s;
}

/* The files exist only in the store's table: there is nothing to remove. */
static int skip_unlink(const char *path)
{
	(void)path;
	return 0;
}

/* User time of FEW evictions from a store of `count` files. */
static double eviction_seconds(unsigned count)
{
	struct disk none = disk_system;
	struct blob_store *s = make_store(count, 0);
	none.unlink = skip_unlink;
	disk_set_calls(&none);
	double begun = user_seconds();
	for (unsigned i = 0; i < FEW; i++)
		assert_true(blob_store_evict(s));
	double took = user_seconds() - begun;
	disk_set_calls(NULL);
	blob_store_close(s);
	return took;
}

static void eviction_time_does_not_grow_with_file_count(void **state)
{
	(void)state;
	double few = eviction_seconds(FEW);
	double many = eviction_seconds(MANY);
	if (many > 8 * few + 0.05)
		fail_msg("%d evictions of %d files took %g s, of %d files %g s", FEW, FEW, few, MANY, many);
}

/* A megabyte has 256 blocks. */
static void write_evicts_as_many_files_as_it_has_blocks(void **state)
{
	(void)state;
	static char chunk[CHUNK];
	const uint64_t limit = FEW * SIZE + CHUNK;
	struct blob_store *s = make_store(FEW, limit);
	struct blob_writer *w;
	struct blob_hash large = hash_of_number(FEW);
	struct error e;
	uint64_t remaining_count = FEW;
	assert_int_equal(blob_write_begin(&w, s, &large, limit, &e), 0);
	assert_int_equal(blob_write_append(w, chunk, CHUNK, &e), 0);
	assert_int_equal(s->bytes, remaining_count * SIZE);
	while (blob_write_offset(w) < limit) {
		uint64_t size = limit - blob_write_offset(w), previous_count = remaining_count;
		assert_int_equal(blob_write_append(w, chunk, size > 8192 ? 8192 : size, &e), 0);
		remaining_count = s->bytes / SIZE;
		assert_in_range(previous_count - remaining_count, 1, 2 + 8);
	}
	blob_write_abort(w);
	assert_false(blob_store_trim(s));
	assert_true(s->bytes <= limit);
	blob_store_close(s);
}

/* All files are evicted in the end, except held ones; the store's bytes and entries agree. */
static void all_files_but_held_ones_are_evicted(void **state)
{
	(void)state;
	struct blob_store *s = make_store(FEW, 0);
	struct blob_hash first = hash_of_number(0), used = hash_of_number(1), held = hash_of_number(2);
	struct error e;
	uint64_t size;
	assert_true(blob_hold(s, &held) && blob_hold(s, &held));
	blob_release(s, &held); /* one hold is left */
	assert_true(blob_hold(s, &first));
	int fd = blob_open(s, &used, &size, &e);
	assert_true(fd >= 0);
	close(fd);
	blob_release(s, &first);
	for (unsigned i = 0; i < FEW - 3; i++)
		assert_true(blob_store_evict(s));
	assert_true(blob_is_stored(s, &used, NULL) && blob_is_stored(s, &first, NULL));
	assert_true(blob_store_evict(s));
	assert_false(blob_is_stored(s, &used, NULL));
	assert_true(blob_store_evict(s));
	assert_false(blob_is_stored(s, &first, NULL));
	assert_false(blob_store_evict(s));
	assert_true(blob_is_stored(s, &held, NULL));
	assert_int_equal(s->bytes, SIZE);
	assert_int_equal(s->idle_bytes, 0);
	assert_in_range(s->count, 1, 2);
	blob_release(s, &held);
	assert_true(blob_store_evict(s));
	blob_store_close(s);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(eviction_time_does_not_grow_with_file_count, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(write_evicts_as_many_files_as_it_has_blocks, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(all_files_but_held_ones_are_evicted, temporary_folder_set_up,
						temporary_folder_tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
