/* SPDX-License-Identifier: Apache-2.0 */
/* A job's row is restored from the file that held its copy, of versions 002 and 003; a damaged or hostile file is
 * refused. */
#include "coordinator/store/old_spool.h"

#include "common/base/bytes.h"
#include "common/base/checked_file.h"
#include "proto/stored.pb-c.h"
#include "tests/support/failing_memory.h"
#include "tests/support/temporary_folder.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static struct spool *spool;
static char path[SPOOL_PATH_MAX];
static struct error e;

enum { JOB = 1 };
static const uint64_t revision = 0x0102030405060708;

/* A row as version 002 wrote it. */
static const unsigned char old_file[] = {
	0x68, 0x73, 0x6c, 0x74, 0x4f, 0x30, 0x30, 0x32, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x03, 0x00,
	0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x08, 0x07, 0x06, 0x05, 0x04, 0x03, 0x02, 0x01, 0x00, 0x00, 0x00, 0x00,
	0x00, 0x00, 0xf8, 0x3f, 0xf9, 0xff, 0xff, 0xff, 0x01, 0x00, 0x00, 0x00, 0x05, 0x00, 0x00, 0x00, 0x00, 0x00,
	0x00, 0x00, 0x06, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x04, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
	0x01, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x05, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x04, 0x00,
	0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x61, 0x6e, 0x6e, 0x61, 0x00, 0x67, 0x6c, 0x61, 0x73, 0x73, 0x00, 0x30,
	0x2e, 0x32, 0x00, 0x00, 0x73, 0x75, 0x62, 0x00, 0x6d, 0x70, 0x6c, 0x61, 0x6e, 0x5c, 0x59, 0x79, 0xbd,
};

static int set_up(void **state)
{
	char name[128];
	if (temporary_folder_set_up(state))
		return -1;
	snprintf(name, sizeof name, "%s/spool", temporary_folder);
	if (spool_open(&spool, name, &e) || spool_create_job_folder(spool, JOB, &e))
		return -1;
	spool_job_path(spool, JOB, "order", path);
	return 0;
}

static int tear_down(void **state)
{
	spool_close(spool);
	return temporary_folder_tear_down(state);
}

/* Writes the file with a checksum that fits. */
static void write_file(const void *bytes, size_t size)
{
	struct checked_file out;
	unlink(path);
	assert_int_equal(checked_file_create(&out, path, &e), 0);
	assert_int_equal(checked_file_write(&out, bytes, size, &e), 0);
	assert_int_equal(checked_file_finish(&out, &e), 0);
	checked_file_close(&out);
}

/* Writes the row as version 003 did. */
static size_t pack_row(unsigned char *bytes)
{
	Stored__Row m;
	char text[5][8] = {"anna", "glass", "0.2", "sub\0m", "plan"};
	stored__row__init(&m);
	m.id = JOB;
	m.extended = 3;
	m.revision = revision;
	m.submitted = 1.5;
	m.priority = -7;
	m.mixed = true;
	m.owner = text[0];
	m.name = text[1];
	m.version = text[2];
	m.submission = (ProtobufCBinaryData){5, (uint8_t *)text[3]};
	m.plan = (ProtobufCBinaryData){4, (uint8_t *)text[4]};
	memcpy(bytes, "hsltO003", 8);
	return 8 + stored__row__pack(&m, bytes + 8);
}

static void assert_row(void)
{
	struct old_row f;
	const struct ledger_job *j = &f.job;
	assert_int_equal(old_spool_read_row(spool, JOB, &f, &e), 0);
	assert_true(j->id == 1 && j->extended == 3 && j->revision == revision && j->priority == -7 && j->is_mixed);
	assert_true(j->submitted == 1.5 && j->end_time == 0 && !j->is_damaged);
	assert_string_equal(j->owner, "anna");
	assert_string_equal(j->name, "glass");
	assert_string_equal(j->version, "0.2");
	assert_string_equal(j->holder, "");
	assert_string_equal(j->state, "live");
	assert_int_equal(j->submission_size, 5);
	assert_memory_equal(j->submission, "sub\0m", 5);
	assert_int_equal(j->plan_size, 4);
	assert_memory_equal(j->plan, "plan", 4);
	old_spool_row_free(&f);
}

static void assert_refused(int rc)
{
	struct old_row f;
	assert_int_equal(old_spool_read_row(spool, JOB, &f, &e), rc);
	assert_null(f.memory);
	assert_null(f.message);
}

static void row_is_read_back(void **state)
{
	(void)state;
	unsigned char bytes[256];
	struct old_row f;
	assert_refused(-ENOENT);
	size_t size = pack_row(bytes);
	write_file(bytes, size);
	assert_row();
	for (int n = 0; n < 4; n++) {
		mem_fail_after(n);
		int rc = old_spool_read_row(spool, JOB, &f, &e);
		mem_fail_after(-1);
		assert_true(rc == -ENOMEM || rc == 0);
		old_spool_row_free(&f);
	}
	/* The file of one job does not restore another job's row. */
	assert_int_equal(spool_create_job_folder(spool, 2, &e), 0);
	spool_job_path(spool, 2, "order", path);
	write_file(bytes, size);
	assert_int_equal(old_spool_read_row(spool, 2, &f, &e), -EBADMSG);
}

static void row_of_version_002_is_read(void **state)
{
	(void)state;
	FILE *f = fopen(path, "wb");
	assert_int_equal(fwrite(old_file, 1, sizeof old_file, f), sizeof old_file);
	fclose(f);
	assert_row();
}

/* The file is cut anywhere, with a checksum that fits or not. */
static void truncated_rows_are_refused(void **state)
{
	(void)state;
	unsigned char bytes[256];
	size_t size = pack_row(bytes);
	for (int old = 0; old < 2; old++) {
		const unsigned char *whole = old ? old_file : bytes;
		size_t whole_size = old ? sizeof old_file - 4 : size;
		for (size_t n = 0; n < whole_size; n++) {
			struct old_row f;
			write_file(whole, n);
			int rc = old_spool_read_row(spool, JOB, &f, &e);
			assert_true(rc == -EBADMSG || rc == -EPROTO);
			assert_int_equal(truncate(path, (off_t)n), 0);
			assert_refused(-EBADMSG);
		}
		write_file(whole, whole_size);
		assert_row();
	}
}

/* Sizes in a file of version 002 that lead out of the file or leave nothing; texts without an end. */
static void sizes_beyond_bounds_are_refused(void **state)
{
	(void)state;
	static const uint64_t sizes[] = {0, 200, 1ull << 32, 1ull << 63, UINT64_MAX, UINT64_MAX - 96};
	unsigned char bytes[sizeof old_file - 4];
	for (int piece = 0; piece < 6; piece++)
		for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
			memcpy(bytes, old_file, sizeof bytes);
			put64(bytes + 48 + 8 * piece, sizes[i]);
			write_file(bytes, sizeof bytes);
			assert_refused(-EBADMSG);
		}
	memcpy(bytes, old_file, sizeof bytes);
	bytes[96 + 4] = 'x';
	write_file(bytes, sizeof bytes);
	assert_refused(-EBADMSG);
}

/* Files of a later version are recognised by the version, or by an unknown field. */
static void file_of_a_later_version_is_refused(void **state)
{
	(void)state;
	unsigned char bytes[256];
	size_t size = pack_row(bytes);
	memcpy(bytes + size, "\xc0\x0c\x01", 3); /* field 200 */
	write_file(bytes, size + 3);
	assert_refused(-EPROTO);
	bytes[7] = '4';
	write_file(bytes, size);
	assert_refused(-EPROTO);
	bytes[0] = 'x';
	write_file(bytes, size);
	assert_refused(-EBADMSG);
	memcpy(bytes, "hsltO003\x5a\xff\xff\xff\xff\x0f", 14); /* a submission of 4 GiB */
	write_file(bytes, 14);
	assert_refused(-EPROTO);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(row_is_read_back, set_up, tear_down),
		cmocka_unit_test_setup_teardown(row_of_version_002_is_read, set_up, tear_down),
		cmocka_unit_test_setup_teardown(truncated_rows_are_refused, set_up, tear_down),
		cmocka_unit_test_setup_teardown(sizes_beyond_bounds_are_refused, set_up, tear_down),
		cmocka_unit_test_setup_teardown(file_of_a_later_version_is_refused, set_up, tear_down),
	};
	return cmocka_run_group_tests_name("coordinator/store/test_old_spool", tests, NULL, NULL);
}
