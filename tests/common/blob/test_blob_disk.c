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
#include "tests/support/folder.h"

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

static int failing_stat(const char *path, struct stat *st)
{
	(void)path;
	(void)st;
	errno = EIO;
	return -1;
}

/* An error of stat is reported, and not taken for a missing file. */
static void a_disk_that_fails(void **state)
{
	(void)state;
	struct blob_store *s;
	struct error e;
	struct disk failing = disk_system;
	failing.stat = failing_stat;
	assert_int_equal(blob_store_open(&s, folder, 0, &e), 0);
	blob_text_store(s, "hello, farm");
	blob_store_close(s);
	disk_use(&failing);
	int rc = blob_store_open(&s, folder, 0, &e);
	disk_use(NULL);
	assert_int_equal(rc, -EIO);
}

static unsigned flushes;

static int count_fsync(int fd)
{
	flushes++;
	return disk_system.fsync(fd);
}

static int failing_close(int fd)
{
	disk_system.close(fd);
	errno = EDQUOT;
	return -1;
}

/* A cache flushes nothing: after a loss of power a name may be there without its bytes, so the file is read before it
 * is used. */
static void flushed_as_needed(void **state)
{
	(void)state;
	struct disk counting = disk_system;
	struct blob_store *s;
	struct error e;
	char path[4096];
	counting.fsync = counting.fdatasync = count_fsync;
	assert_int_equal(blob_store_open(&s, folder, 0, &e), 0);
	disk_use(&counting);
	flushes = 0;
	blob_text_store(s, "kept");
	assert_int_equal(flushes, 2);
	blob_store_use_as_cache(s);
	struct blob_hash h = blob_text_store(s, "cached");
	assert_int_equal(flushes, 2);
	disk_use(NULL);
	assert_int_equal(blob_check(s, &h, 60, &e), 0);
	blob_path(s, &h, path, sizeof path);
	blob_store_close(s);
	assert_int_equal(truncate(path, 3), 0);
	assert_int_equal(blob_store_open(&s, folder, 0, &e), 0);
	assert_int_equal(blob_check(s, &h, 60, &e), -EBADMSG);
	blob_store_close(s);
}

/* A network file system that writes when the file is closed may fail there. */
static void a_cached_file_that_cannot_be_closed(void **state)
{
	(void)state;
	struct disk failing = disk_system;
	struct blob_store *s;
	struct blob_writer *w;
	struct blob_hash h;
	struct error e;
	failing.close = failing_close;
	assert_int_equal(blob_store_open(&s, folder, 0, &e), 0);
	blob_store_use_as_cache(s);
	assert_int_equal(blob_hash_bytes("lost", 4, &h, &e), 0);
	assert_int_equal(blob_write_begin(&w, s, &h, 4, &e), 0);
	assert_int_equal(blob_write_add(w, "lost", 4, &e), 0);
	disk_use(&failing);
	int rc = blob_write_commit(w, &e);
	disk_use(NULL);
	assert_int_equal(rc, -EDQUOT);
	assert_false(blob_has(s, &h, NULL));
	blob_store_close(s);
}

static struct blob_writer *write_text(struct blob_store *s, const char *text, struct blob_hash *h)
{
	struct blob_writer *w;
	struct error e;
	assert_int_equal(blob_hash_bytes(text, strlen(text), h, &e), 0);
	assert_int_equal(blob_write_begin(&w, s, h, strlen(text), &e), 0);
	assert_int_equal(blob_write_add(w, text, strlen(text), &e), 0);
	return w;
}

/* The files of a batch are in the store once the batch was entered, and not before; files that were not entered are
 * gone, and their room is free. */
static void flushed_together(void **state)
{
	(void)state;
	struct blob_store *s;
	struct blob_hash h[3];
	struct error e;
	assert_int_equal(blob_store_open(&s, folder, 30, &e), 0);
	struct blob_batch *b = blob_batch_new(s);
	assert_int_equal(blob_batch_add(b, write_text(s, "0123456789", &h[0]), &e), 0);
	assert_int_equal(blob_batch_add(b, write_text(s, "abcdefghij", &h[1]), &e), 0);
	assert_int_equal(blob_batch_count(b), 2);
	assert_false(blob_has(s, &h[0], NULL) || blob_hold(s, &h[1]));
	assert_int_equal(blob_batch_flush(b, &e), 0);
	assert_false(blob_has(s, &h[0], NULL));
	blob_batch_enter(b);
	assert_true(blob_has(s, &h[0], NULL) && blob_has(s, &h[1], NULL));
	assert_true(blob_hold(s, blob_batch_hash(b, 0)));
	blob_batch_free(b);
	b = blob_batch_new(s); /* its ten bytes fit without evicting h[1] */
	assert_int_equal(blob_batch_add(b, write_text(s, "ABCDEFGHIJ", &h[2]), &e), 0);
	blob_batch_free(b);
	assert_true(blob_has(s, &h[1], NULL) && !blob_has(s, &h[2], NULL));
	assert_int_equal(blob_text_bytes(folder), 20);
	struct blob_hash other = blob_text_store(s, "ABCDEFGHIJ");
	assert_true(blob_hash_equal(&other, &h[2]) && blob_has(s, &h[1], NULL));
	blob_store_close(s);
}

/* Two clients send the same file: one of them stores it first, and neither loses it. */
static void stored_meanwhile(void **state)
{
	(void)state;
	struct blob_store *s;
	struct blob_hash h;
	struct error e;
	uint64_t size;
	assert_int_equal(blob_store_open(&s, folder, 30, &e), 0);
	struct blob_batch *b = blob_batch_new(s);
	assert_int_equal(blob_batch_add(b, write_text(s, "0123456789", &h), &e), 0);
	blob_text_store(s, "0123456789");
	blob_release(s, &h);
	assert_int_equal(blob_batch_flush(b, &e), 0);
	blob_batch_enter(b);
	blob_batch_free(b);
	assert_true(blob_has(s, &h, &size) && size == 10);
	struct blob_hash more = blob_text_store(s, "twenty bytes of text"); /* fits beside it */
	assert_true(blob_has(s, &h, NULL) && blob_has(s, &more, NULL));
	blob_store_close(s);
}

/* Power is lost before the flush: the next start finds nothing of the file. */
static void not_flushed(void **state)
{
	(void)state;
	struct blob_store *s;
	struct blob_hash h, awaited = blob_text_hash("awaited");
	struct error e;
	assert_int_equal(blob_store_open(&s, folder, 0, &e), 0);
	assert_int_equal(blob_expect(s, &awaited, &e), 0);
	struct blob_batch *b = blob_batch_new(s);
	assert_int_equal(blob_batch_add(b, write_text(s, "0123456789", &h), &e), 0);
	struct blob_store *next;
	assert_int_equal(blob_store_open(&next, folder, 0, &e), 0);
	assert_false(blob_has(next, &h, NULL));
	assert_int_equal(blob_text_bytes(folder), 0);
	blob_store_close(next);
	assert_int_equal(blob_batch_flush(b, &e), -ENOENT);
	blob_batch_free(b);
	assert_false(blob_has(s, &h, NULL));
	assert_int_equal(s->count, 1);
	blob_store_close(s);
}

static int full_with; /* errno of writes as long as there are files */
static char full_while[256];

static ssize_t write_where_room_is(int fd, const struct iovec *parts, int count, off_t at)
{
	struct stat st;
	if (lstat(full_while, &st) == 0) {
		errno = full_with;
		return -1;
	}
	return pwritev(fd, parts, count, at);
}

static bool remove_that_file(void *user)
{
	++*(int *)user;
	return unlink(full_while) == 0;
}

/* On a full disk, or when a quota is used up, files that nobody holds are evicted first; then whoever holds more is
 * asked to free some. */
static void a_disk_that_is_full(void **state)
{
	(void)state;
	static const int codes[] = {ENOSPC, EDQUOT};
	struct disk full = disk_system;
	full.pwritev = write_where_room_is;
	for (size_t i = 0; i < sizeof codes / sizeof *codes; i++) {
		struct blob_store *s;
		struct error e;
		int asked = 0;
		full_with = codes[i];
		assert_int_equal(blob_store_open(&s, folder, 1000, &e), 0);
		struct blob_hash a = blob_text_store(s, "nobody holds this");
		blob_release(s, &a);
		blob_path(s, &a, full_while, sizeof full_while);
		disk_use(&full);
		blob_text_store(s, i ? "one" : "two");
		assert_false(blob_has(s, &a, NULL));
		blob_store_ask(s, remove_that_file, &asked);
		snprintf(full_while, sizeof full_while, "%s/films", folder);
		fclose(fopen(full_while, "w"));
		blob_text_store(s, i ? "three" : "four");
		assert_int_equal(asked, 1);
		disk_use(NULL);
		blob_store_close(s);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(a_disk_that_fails, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(a_cached_file_that_cannot_be_closed, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(flushed_as_needed, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(a_disk_that_is_full, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(flushed_together, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(stored_meanwhile, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(not_flushed, folder_set_up, folder_tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
