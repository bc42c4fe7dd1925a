/* SPDX-License-Identifier: Apache-2.0 */
/* A journal has the same bytes in every build and on every machine. */
#include "coordinator/store/journal.h"
#include "coordinator/store/journal_file.h"
#include "common/base/bytes.h"
#include "common/base/crc.h"
#include "tests/support/temporary_folder.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <stdio.h>
#include <string.h>

enum { GENERATION = 3 };

/* A journal as the first builds wrote it, from structs as they lay in memory on x86-64: a batch "abcde" of a lease, and
 * counters. */
enum { OLD_FIRST = JOURNAL_HEAD_SIZE, OLD_SECOND = OLD_FIRST + JOURNAL_RECORD_HEAD_SIZE + 5 };
static const uint64_t old_job = 0x0102030405060708, old_salt = 0x8877665544332211;
static const struct lease_key old_lease = {0, LEASE_RENDER, 5, 6, 0x1122334455667788};
static const unsigned char old_journal[] = {
	0x68, 0x73, 0x6c, 0x74, 0x4a, 0x30, 0x30, 0x32, 0x08, 0x07, 0x06, 0x05, 0x04, 0x03, 0x02, 0x01, 0x03, 0x00,
	0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77, 0x88, 0x47, 0xae, 0x3b, 0xc7,
	0x00, 0x00, 0x00, 0x00, 0xf1, 0x68, 0x6a, 0x0d, 0x05, 0x00, 0x00, 0x00, 0x97, 0xd6, 0x50, 0xc4, 0x01, 0x00,
	0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
	0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0xf8, 0x3f, 0x02, 0x00, 0x00, 0x00, 0x05, 0x00, 0x00, 0x00, 0x06, 0x00,
	0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x88, 0x77, 0x66, 0x55, 0x44, 0x33, 0x22, 0x11, 0x11, 0x22, 0x33, 0x44,
	0x55, 0x66, 0x77, 0x88, 0x00, 0x00, 0x00, 0x00, 0xd1, 0x32, 0x4a, 0x20, 0x61, 0x62, 0x63, 0x64, 0x65, 0xf1,
	0x68, 0x6a, 0x0d, 0x02, 0x00, 0x00, 0x00, 0x81, 0xd0, 0xbf, 0xb8, 0x08, 0x00, 0x00, 0x00, 0x01, 0x00, 0x00,
	0x00, 0x00, 0x00, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
	0x00, 0x04, 0x40, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
	0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77, 0x88, 0x00,
	0x00, 0x00, 0x00, 0xd5, 0xe7, 0x36, 0x39, 0x08, 0x07,
};

static int check_old_item(void *user, const struct journal_item *i, struct error *e)
{
	unsigned *count = user;
	struct lease_key k = old_lease;
	(void)e;
	k.job = old_job;
	if (*count == 0) {
		assert_true(i->kind == JOURNAL_BATCH && i->elapsed == 1.5 && lease_key_equal(&i->lease, &k));
		assert_int_equal(i->body_size, 5);
		assert_memory_equal(i->body, "abcde", 5);
		assert_int_equal(i->offset, OLD_FIRST);
	} else {
		assert_true(i->kind == JOURNAL_COUNTS && i->elapsed == 2.5 && i->lease.kind == 0 && i->body_size == 2);
		assert_memory_equal(i->body, "\x08\x07", 2);
		assert_int_equal(i->offset, OLD_SECOND);
	}
	assert_int_equal(i->damaged_count, 0);
	++*count;
	return 0;
}

static void earlier_journals_are_read(void **state)
{
	(void)state;
	struct journal_damage found;
	struct journal *j;
	struct error e;
	unsigned count = 0;
	char path[512];
	snprintf(path, sizeof path, "%s/journal.%d", temporary_folder, GENERATION);
	FILE *f = fopen(path, "wb");
	assert_int_equal(fwrite(old_journal, 1, sizeof old_journal, f), sizeof old_journal);
	fclose(f);
	assert_int_equal(journal_open(&j, temporary_folder, old_job, GENERATION, check_old_item, &count, &found, &e),
			 0);
	assert_int_equal(count, 2);
	assert_true(found.cut_bytes == 0 && found.damaged_count == 0);
	journal_release(j);
}

/* A journal written now has each number where it has always been. */
static void bytes_of_journals_never_change(void **state)
{
	(void)state;
	unsigned char head[JOURNAL_HEAD_SIZE], bytes[JOURNAL_RECORD_HEAD_SIZE];
	struct buf a = {.limit = 8}, b = {.limit = 8}, none = {.limit = 0};
	struct journal_record r = {.kind = JOURNAL_BATCH, .elapsed = 1.5, .lease = old_lease, .salt = old_salt};
	assert_true(buf_append(&a, "ab", 2) && buf_append(&b, "cde", 3));
	journal_head_pack(&(struct journal_head){old_job, GENERATION, old_salt}, head);
	assert_memory_equal(head, old_journal, sizeof head);
	journal_record_pack(&r, bytes, &a, &b);
	assert_memory_equal(bytes, old_journal + OLD_FIRST, sizeof bytes);
	a.size = 0;
	assert_true(buf_append(&a, "\x08\x07", 2));
	r = (struct journal_record){
		.kind = JOURNAL_COUNTS, .number = 1, .durable_count_before = 1, .elapsed = 2.5, .salt = old_salt};
	journal_record_pack(&r, bytes, &a, &none);
	assert_memory_equal(bytes, old_journal + OLD_SECOND, sizeof bytes);
	buf_fini(&a);
	buf_fini(&b);
}

/* Record heads whose checksums fit, with sizes beyond the end of the file: they are not taken for records, and nothing
 * is allocated for them. */
static void record_sizes_beyond_the_file_are_not_believed(void **state)
{
	(void)state;
	static const uint32_t sizes[] = {6, 1000, 1u << 31, UINT32_MAX};
	char path[512];
	snprintf(path, sizeof path, "%s/journal.%d", temporary_folder, GENERATION);
	for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
		unsigned char file[sizeof old_journal];
		struct journal_damage found;
		struct journal *j;
		struct error e;
		unsigned count = 0;
		memcpy(file, old_journal, sizeof file);
		put32(file + OLD_SECOND + 4, sizes[i]);
		put32(file + OLD_SECOND + 76, crc32c(0, file + OLD_SECOND, 76));
		FILE *f = fopen(path, "wb");
		assert_int_equal(fwrite(file, 1, sizeof file, f), sizeof file);
		fclose(f);
		assert_int_equal(
			journal_open(&j, temporary_folder, old_job, GENERATION, check_old_item, &count, &found, &e), 0);
		assert_int_equal(count, 1);
		assert_int_equal(found.cut_bytes, sizeof file - OLD_SECOND);
		journal_release(j);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(earlier_journals_are_read, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test(bytes_of_journals_never_change),
		cmocka_unit_test_setup_teardown(record_sizes_beyond_the_file_are_not_believed, temporary_folder_set_up,
						temporary_folder_tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
