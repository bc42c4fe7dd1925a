/* SPDX-License-Identifier: Apache-2.0 */
/* Memory and disk space of journals: the bytes that wait to be written are bounded, and reserved room is kept. */
#include "coordinator/store/journal.h"
#include "coordinator/store/journal_file.h"
#include "common/base/disk.h"
#include "tests/support/folder.h"

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

static void path_of(char path[512])
{
	snprintf(path, 512, "%s/journal.%d", folder, GENERATION);
}

static off_t length_of_file(void)
{
	char path[512];
	struct stat st;
	path_of(path);
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
static void memory_is_bounded(void **state)
{
	(void)state;
	enum { PIECE = 1 << 24, MOST = 1 << 28 };
	struct journal *j, *other;
	struct error e;
	struct buf b = make_piece(PIECE);
	assert_int_equal(journal_create(&other, folder, JOB, GENERATION + 1, &e), 0);
	assert_int_equal(journal_append(other, JOURNAL_BATCH, NULL, 1, "", 0, &b, &e), 0);
	assert_int_equal(journal_create(&j, folder, JOB, GENERATION, &e), 0);
	off_t empty = length_of_file();
	for (unsigned n = 1; n < MOST / PIECE; n++) { /* with the heads of records it is a little more */
		b = make_piece(PIECE);
		assert_int_equal(length_of_file(), empty);
		assert_int_equal(journal_append(j, JOURNAL_BATCH, NULL, 1, "", 0, &b, &e), 0);
	}
	off_t written = length_of_file();
	assert_true(written > empty + MOST - PIECE);
	assert_int_equal(journal_bytes(j), written);
	assert_int_equal(journal_append(j, JOURNAL_BATCH, NULL, 1, "more", 4, NULL, &e), 0);
	assert_int_equal(length_of_file(), written);
	assert_int_equal(journal_write(j, &e), 0);
	assert_int_equal(length_of_file(), journal_bytes(j));
	journal_settle(other);
	journal_release(other);
	journal_release(j);
}

static struct journal *at_hand;

static ssize_t appending_pwritev(int fd, const struct iovec *parts, int count, off_t at)
{
	struct error e;
	if (journal_bytes(at_hand) < 10000)
		assert_int_equal(journal_append(at_hand, JOURNAL_BATCH, NULL, 1, "more", 4, NULL, &e), 0);
	return pwritev(fd, parts, count, at);
}

/* While a journal is written more and more is appended: a flush does not wait for the last record. */
static void a_flush_comes_to_an_end(void **state)
{
	(void)state;
	struct disk busy = disk_system;
	struct error e;
	busy.pwritev = appending_pwritev;
	assert_int_equal(journal_create(&at_hand, folder, JOB, GENERATION, &e), 0);
	assert_int_equal(journal_append(at_hand, JOURNAL_BATCH, NULL, 1, "first", 5, NULL, &e), 0);
	off_t end = (off_t)journal_bytes(at_hand);
	disk_use(&busy);
	assert_int_equal(journal_sync(at_hand, &e), 0);
	disk_use(NULL);
	assert_int_equal(length_of_file(), end);
	journal_release(at_hand);
}

static off_t room_end;

static int small_fallocate(int fd, int mode, off_t at, off_t size)
{
	(void)fd;
	(void)mode;
	if (at + size > 1000) {
		errno = ENOSPC;
		return -1;
	}
	room_end = at + size;
	return 0;
}

static int forgetting_ftruncate(int fd, off_t size)
{
	room_end = size;
	return ftruncate(fd, size);
}

/* A record for which there is no room takes none from records that were appended and are not written yet. */
static void promised_room_is_kept(void **state)
{
	(void)state;
	static const char body[2000];
	struct disk small = disk_system;
	struct journal *j;
	struct error e;
	small.fallocate = small_fallocate;
	small.ftruncate = forgetting_ftruncate;
	disk_use(&small);
	assert_int_equal(journal_create(&j, folder, JOB, GENERATION, &e), 0);
	assert_int_equal(journal_reserve(j, 500, &e), 0);
	assert_int_equal(journal_append(j, JOURNAL_BATCH, NULL, 1, body, 500, NULL, &e), 0);
	assert_int_equal(journal_reserve(j, 900, &e), -ENOSPC);
	assert_int_equal(room_end, journal_bytes(j));
	assert_int_equal(journal_sync(j, &e), 0);
	disk_use(NULL);
	journal_release(j);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(memory_is_bounded, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(a_flush_comes_to_an_end, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(promised_room_is_kept, folder_set_up, folder_tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
