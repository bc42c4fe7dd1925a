/* SPDX-License-Identifier: Apache-2.0 */
/* Memory and disk space of journals: the bytes that wait to be written are bounded, and reserved room is kept. */
#include "coordinator/store/journal.h"
#include "coordinator/store/journal_file.h"
#include "common/base/disk.h"
#include "tests/support/temporary_folder.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <errno.h>
#include <stdio.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

enum { JOB = 12, GENERATION = 3 };

static void get_journal_path(char path[512])
{
	snprintf(path, 512, "%s/journal.%d", temporary_folder, GENERATION);
}

static off_t journal_file_length(void)
{
	char path[512];
	struct stat st;
	get_journal_path(path);
	assert_int_equal(stat(path, &st), 0);
	return st.st_size;
}

static struct buf make_piece(size_t size)
{
	struct buf b = {.limit = size};
	assert_true(buf_reserve(&b, size));
	b.size = size;
	return b;
}

/* Appended records are written with the next flush, or earlier if the waiting records of all journals would take too
 * much memory. */
static void memory_of_waiting_records_is_bounded(void **state)
{
	(void)state;
	enum { PIECE = 1 << 24, WAITING_BYTES_MAX = 1 << 28 };
	struct journal *j, *other;
	struct error e;
	struct buf b = make_piece(PIECE);
	assert_int_equal(journal_create(&other, temporary_folder, JOB, GENERATION + 1, &e), 0);
	assert_int_equal(journal_append(other, JOURNAL_BATCH, NULL, 1, "", 0, &b, &e), 0);
	assert_int_equal(journal_create(&j, temporary_folder, JOB, GENERATION, &e), 0);
	off_t empty = journal_file_length();
	for (unsigned n = 1; n < WAITING_BYTES_MAX / PIECE; n++) { /* with the heads of records it is a little more */
		b = make_piece(PIECE);
		assert_int_equal(journal_file_length(), empty);
		assert_int_equal(journal_append(j, JOURNAL_BATCH, NULL, 1, "", 0, &b, &e), 0);
	}
	off_t written = journal_file_length();
	assert_true(written > empty + WAITING_BYTES_MAX - PIECE);
	assert_int_equal(journal_bytes(j), written);
	assert_int_equal(journal_append(j, JOURNAL_BATCH, NULL, 1, "more", 4, NULL, &e), 0);
	assert_int_equal(journal_file_length(), written);
	assert_int_equal(journal_write(j, &e), 0);
	assert_int_equal(journal_file_length(), journal_bytes(j));
	journal_mark_settled(other);
	journal_release(other);
	journal_release(j);
}

static struct journal *busy_journal;

static ssize_t appending_pwritev(int fd, const struct iovec *parts, int count, off_t offset)
{
	struct error e;
	if (journal_bytes(busy_journal) < 10000)
		assert_int_equal(journal_append(busy_journal, JOURNAL_BATCH, NULL, 1, "more", 4, NULL, &e), 0);
	return pwritev(fd, parts, count, offset);
}

/* While a journal is written more and more is appended: a flush does not wait for the last record. */
static void flush_ends_despite_new_records(void **state)
{
	(void)state;
	struct disk busy = disk_system;
	struct error e;
	busy.pwritev = appending_pwritev;
	assert_int_equal(journal_create(&busy_journal, temporary_folder, JOB, GENERATION, &e), 0);
	assert_int_equal(journal_append(busy_journal, JOURNAL_BATCH, NULL, 1, "first", 5, NULL, &e), 0);
	off_t end = (off_t)journal_bytes(busy_journal);
	disk_set_calls(&busy);
	assert_int_equal(journal_sync(busy_journal, &e), 0);
	disk_set_calls(NULL);
	assert_int_equal(journal_file_length(), end);
	journal_release(busy_journal);
}

static off_t reserved_end;

static int small_fallocate(int fd, int mode, off_t offset, off_t size)
{
	(void)fd;
	(void)mode;
	if (offset + size > 1000) {
		errno = ENOSPC;
		return -1;
	}
	reserved_end = offset + size;
	return 0;
}

static int recording_ftruncate(int fd, off_t size)
{
	reserved_end = size;
	return ftruncate(fd, size);
}

/* A record for which there is no room takes none from records that were appended and are not written yet. */
static void reserved_room_is_kept(void **state)
{
	(void)state;
	static const char body[2000];
	struct disk small = disk_system;
	struct journal *j;
	struct error e;
	small.fallocate = small_fallocate;
	small.ftruncate = recording_ftruncate;
	disk_set_calls(&small);
	assert_int_equal(journal_create(&j, temporary_folder, JOB, GENERATION, &e), 0);
	assert_int_equal(journal_reserve(j, 500, &e), 0);
	assert_int_equal(journal_append(j, JOURNAL_BATCH, NULL, 1, body, 500, NULL, &e), 0);
	assert_int_equal(journal_reserve(j, 900, &e), -ENOSPC);
	assert_int_equal(reserved_end, journal_bytes(j));
	assert_int_equal(journal_sync(j, &e), 0);
	disk_set_calls(NULL);
	journal_release(j);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(memory_of_waiting_records_is_bounded, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(flush_ends_despite_new_records, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(reserved_room_is_kept, temporary_folder_set_up,
						temporary_folder_tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
