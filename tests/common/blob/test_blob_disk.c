/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The store of files on a disk that fails: errors are reported and cost no file. A store that must survive a loss of
 * power flushes files, alone or in batches, before it reports them as stored; a cache never flushes, and reads its
 * files again after a restart. When the disk is full, the file that could not be written is removed.
 */
#include "common/base/disk.h"
#include "common/blob/blob_batch.h"
#include "common/blob/blob_check.h"
#include "common/blob/blob_state.h"
#include "tests/support/blob_text.h"
#include "tests/support/temporary_folder.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <errno.h>
#include <sys/stat.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

static int fail_stat(const char *path, struct stat *st)
{
	(void)path;
	(void)st;
	errno = EIO;
	return -1;
}

/* An error of stat is reported, and not taken for a missing file. */
static void stat_error_is_not_taken_for_a_missing_file(void **state)
{
	(void)state;
	struct blob_store *s;
	struct error e;
	struct disk failing = disk_system;
	failing.stat = fail_stat;
	assert_int_equal(blob_store_open(&s, temporary_folder, 0, &e), 0);
	blob_text_store(s, "hello, farm");
	blob_store_close(s);
	disk_set_calls(&failing);
	int rc = blob_store_open(&s, temporary_folder, 0, &e);
	disk_set_calls(NULL);
	assert_int_equal(rc, -EIO);
}

static unsigned flush_count;

static int fsync_and_count(int fd)
{
	flush_count++;
	return disk_system.fsync(fd);
}

static int fail_close(int fd)
{
	disk_system.close(fd);
	errno = EDQUOT;
	return -1;
}

/* A cache flushes nothing: after a loss of power a name may be there without its bytes, so the file is read before it
 * is used. */
static void store_flushes_and_cache_does_not(void **state)
{
	(void)state;
	struct disk counting = disk_system;
	struct blob_store *s;
	struct error e;
	char path[4096];
	counting.fsync = counting.fdatasync = fsync_and_count;
	assert_int_equal(blob_store_open(&s, temporary_folder, 0, &e), 0);
	disk_set_calls(&counting);
	flush_count = 0;
	blob_text_store(s, "kept");
	assert_int_equal(flush_count, 2);
	blob_store_use_as_cache(s);
	struct blob_hash h = blob_text_store(s, "cached");
	assert_int_equal(flush_count, 2);
	disk_set_calls(NULL);
	assert_int_equal(blob_check(s, &h, 60, &e), 0);
	blob_path(s, &h, path, sizeof path);
	blob_store_close(s);
	assert_int_equal(truncate(path, 3), 0);
	assert_int_equal(blob_store_open(&s, temporary_folder, 0, &e), 0);
	assert_int_equal(blob_check(s, &h, 60, &e), -EBADMSG);
	blob_store_close(s);
}

/* A network file system that writes when the file is closed may fail there. */
static void cached_file_that_fails_to_close_is_not_stored(void **state)
{
	(void)state;
	struct disk failing = disk_system;
	struct blob_store *s;
	struct blob_writer *w;
	struct blob_hash h;
	struct error e;
	failing.close = fail_close;
	assert_int_equal(blob_store_open(&s, temporary_folder, 0, &e), 0);
	blob_store_use_as_cache(s);
	assert_int_equal(blob_hash_bytes("lost", 4, &h, &e), 0);
	assert_int_equal(blob_write_begin(&w, s, &h, 4, &e), 0);
	assert_int_equal(blob_write_append(w, "lost", 4, &e), 0);
	disk_set_calls(&failing);
	int rc = blob_write_commit(w, &e);
	disk_set_calls(NULL);
	assert_int_equal(rc, -EDQUOT);
	assert_false(blob_is_stored(s, &h, NULL));
	blob_store_close(s);
}

static struct blob_writer *write_uncommitted_text(struct blob_store *s, const char *text, struct blob_hash *h)
{
	struct blob_writer *w;
	struct error e;
	assert_int_equal(blob_hash_bytes(text, strlen(text), h, &e), 0);
	assert_int_equal(blob_write_begin(&w, s, h, strlen(text), &e), 0);
	assert_int_equal(blob_write_append(w, text, strlen(text), &e), 0);
	return w;
}

/* The files of a batch are in the store once the batch was entered, and not before; files that were not entered are
 * gone, and their room is free. */
static void batch_files_appear_once_entered(void **state)
{
	(void)state;
	struct blob_store *s;
	struct blob_hash h[3];
	struct error e;
	assert_int_equal(blob_store_open(&s, temporary_folder, 30, &e), 0);
	struct blob_batch *b = blob_batch_new(s);
	assert_int_equal(blob_batch_add(b, write_uncommitted_text(s, "0123456789", &h[0]), &e), 0);
	assert_int_equal(blob_batch_add(b, write_uncommitted_text(s, "abcdefghij", &h[1]), &e), 0);
	assert_int_equal(blob_batch_count(b), 2);
	assert_false(blob_is_stored(s, &h[0], NULL) || blob_hold(s, &h[1]));
	assert_int_equal(blob_batch_flush(b, &e), 0);
	assert_false(blob_is_stored(s, &h[0], NULL));
	blob_batch_commit(b);
	assert_true(blob_is_stored(s, &h[0], NULL) && blob_is_stored(s, &h[1], NULL));
	assert_true(blob_hold(s, blob_batch_hash(b, 0)));
	blob_batch_free(b);
	b = blob_batch_new(s); /* its ten bytes fit without evicting h[1] */
	assert_int_equal(blob_batch_add(b, write_uncommitted_text(s, "ABCDEFGHIJ", &h[2]), &e), 0);
	blob_batch_free(b);
	assert_true(blob_is_stored(s, &h[1], NULL) && !blob_is_stored(s, &h[2], NULL));
	assert_int_equal(blob_text_folder_bytes(temporary_folder), 20);
	struct blob_hash other = blob_text_store(s, "ABCDEFGHIJ");
	assert_true(blob_hash_equal(&other, &h[2]) && blob_is_stored(s, &h[1], NULL));
	blob_store_close(s);
}

/* Two clients send the same file: one of them stores it first, and neither loses it. */
static void file_stored_by_two_clients_is_kept(void **state)
{
	(void)state;
	struct blob_store *s;
	struct blob_hash h;
	struct error e;
	uint64_t size;
	assert_int_equal(blob_store_open(&s, temporary_folder, 30, &e), 0);
	struct blob_batch *b = blob_batch_new(s);
	assert_int_equal(blob_batch_add(b, write_uncommitted_text(s, "0123456789", &h), &e), 0);
	blob_text_store(s, "0123456789");
	blob_release(s, &h);
	assert_int_equal(blob_batch_flush(b, &e), 0);
	blob_batch_commit(b);
	blob_batch_free(b);
	assert_true(blob_is_stored(s, &h, &size) && size == 10);
	struct blob_hash more = blob_text_store(s, "twenty bytes of text"); /* fits beside it */
	assert_true(blob_is_stored(s, &h, NULL) && blob_is_stored(s, &more, NULL));
	blob_store_close(s);
}

/* Power is lost before the flush: the next start finds nothing of the file. */
static void unflushed_file_is_gone_after_restart(void **state)
{
	(void)state;
	struct blob_store *s;
	struct blob_hash h, awaited = blob_text_hash("awaited");
	struct error e;
	assert_int_equal(blob_store_open(&s, temporary_folder, 0, &e), 0);
	assert_int_equal(blob_hold_expected(s, &awaited, &e), 0);
	struct blob_batch *b = blob_batch_new(s);
	assert_int_equal(blob_batch_add(b, write_uncommitted_text(s, "0123456789", &h), &e), 0);
	struct blob_store *next;
	assert_int_equal(blob_store_open(&next, temporary_folder, 0, &e), 0);
	assert_false(blob_is_stored(next, &h, NULL));
	assert_int_equal(blob_text_folder_bytes(temporary_folder), 0);
	blob_store_close(next);
	assert_int_equal(blob_batch_flush(b, &e), -ENOENT);
	blob_batch_free(b);
	assert_false(blob_is_stored(s, &h, NULL));
	assert_int_equal(s->count, 1);
	blob_store_close(s);
}

static int full_disk_errno; /* errno of writes as long as there are files */
static char disk_filling_path[256];

static ssize_t write_unless_disk_is_full(int fd, const struct iovec *parts, int count, off_t offset)
{
	struct stat st;
	if (lstat(disk_filling_path, &st) == 0) {
		errno = full_disk_errno;
		return -1;
	}
	return pwritev(fd, parts, count, offset);
}

static bool remove_disk_filling_file(void *user)
{
	++*(int *)user;
	return unlink(disk_filling_path) == 0;
}

/* On a full disk, or when a quota is used up, files that nobody holds are evicted first; then whoever holds more is
 * asked to free some. */
static void full_disk_evicts_files_then_asks_for_room(void **state)
{
	(void)state;
	static const int codes[] = {ENOSPC, EDQUOT};
	struct disk full = disk_system;
	full.pwritev = write_unless_disk_is_full;
	for (size_t i = 0; i < sizeof codes / sizeof *codes; i++) {
		struct blob_store *s;
		struct error e;
		int request_count = 0;
		full_disk_errno = codes[i];
		assert_int_equal(blob_store_open(&s, temporary_folder, 1000, &e), 0);
		struct blob_hash a = blob_text_store(s, "nobody holds this");
		blob_release(s, &a);
		blob_path(s, &a, disk_filling_path, sizeof disk_filling_path);
		disk_set_calls(&full);
		blob_text_store(s, i ? "one" : "two");
		assert_false(blob_is_stored(s, &a, NULL));
		blob_store_set_full_handler(s, remove_disk_filling_file, &request_count);
		snprintf(disk_filling_path, sizeof disk_filling_path, "%s/films", temporary_folder);
		fclose(fopen(disk_filling_path, "w"));
		blob_text_store(s, i ? "three" : "four");
		assert_int_equal(request_count, 1);
		disk_set_calls(NULL);
		blob_store_close(s);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(stat_error_is_not_taken_for_a_missing_file, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(cached_file_that_fails_to_close_is_not_stored, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(store_flushes_and_cache_does_not, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(full_disk_evicts_files_then_asks_for_room, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(batch_files_appear_once_entered, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(file_stored_by_two_clients_is_kept, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(unflushed_file_is_gone_after_restart, temporary_folder_set_up,
						temporary_folder_tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
