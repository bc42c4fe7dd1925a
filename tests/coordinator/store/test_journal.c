/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The journal of a job's results gives back every record that was appended completely, in order, and no other: after a
 * cut at every byte, a flip of every bit, holes, records forged inside of records, read errors, a loss of power and a
 * full disk. A damaged record costs itself alone; a read error is reported as such and never mistaken for the end of
 * the journal.
 */
#include "coordinator/store/journal.h"
#include "coordinator/store/journal_file.h"
#include "common/base/crc.h"
#include "common/base/disk.h"
#include "tests/support/temporary_folder.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <fcntl.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <signal.h>
#include <unistd.h>

enum { RECORDS = 5, JOB = 12, GENERATION = 3 };

static const size_t sizes[RECORDS] = {17, 0, 1, 64, 9};

struct replay {
	unsigned count;				   /* records, including those that are missing */
	uint64_t missing_count, known_lease_count; /* known_lease_count: those whose leases are known */
	double elapsed;
	bool is_wrong;
	uint64_t offsets[RECORDS + 2];
};

static unsigned char record_byte(unsigned record, size_t i)
{
	return (unsigned char)(31 * record + 7 * i + 1);
}

static struct lease_key record_lease(unsigned record)
{
	return (struct lease_key){
		.job = JOB, .kind = LEASE_RENDER, .group = record, .part = 7 * record, .epoch = 100 + record};
}

static int check_item(void *user, const struct journal_item *i, struct error *e)
{
	struct replay *s = user;
	struct lease_key k = record_lease(s->count);
	(void)e;
	if (i->kind) /* a record, or one of which only the body is damaged */
		s->is_wrong |= s->count >= RECORDS || i->kind != (enum journal_kind)(1 + s->count % 3) ||
			       i->body_size != sizes[s->count] || i->elapsed <= s->elapsed ||
			       !lease_key_equal(&i->lease, &k);
	for (size_t n = 0; !i->damaged_count && n < i->body_size && !s->is_wrong; n++)
		s->is_wrong |= i->body[n] != record_byte(s->count, n);
	if (i->kind)
		s->elapsed = i->elapsed;
	if (s->count < RECORDS + 2)
		s->offsets[s->count] = i->offset;
	s->missing_count += i->damaged_count;
	s->known_lease_count += i->damaged_count && i->kind;
	s->count += i->damaged_count ? (unsigned)i->damaged_count : 1;
	return 0;
}

static void append_record(struct journal *j, unsigned record)
{
	unsigned char body[64];
	struct lease_key k = record_lease(record);
	struct error e;
	for (size_t i = 0; i < sizes[record]; i++)
		body[i] = record_byte(record, i);
	size_t first = sizes[record] / 3;
	struct buf rest = {.limit = sizes[record]};
	assert_true(buf_append(&rest, body + first, sizes[record] - first));
	assert_int_equal(
		journal_append(j, (enum journal_kind)(1 + record % 3), &k, 0.5 + record, body, first, &rest, &e), 0);
	assert_null(rest.bytes);
}

/* bytes of the file after each record; [0]: without any */
static void write_journal(uint64_t ends[RECORDS + 1])
{
	struct journal *j;
	struct error e;
	assert_int_equal(journal_create(&j, temporary_folder, JOB, GENERATION, &e), 0);
	ends[0] = journal_bytes(j);
	for (unsigned i = 0; i < RECORDS; i++) {
		append_record(j, i);
		ends[i + 1] = journal_bytes(j);
		assert_int_equal(journal_sync(j, &e), 0);
	}
	journal_release(j);
}

static int reopen_journal(struct journal **j, struct replay *s, struct journal_damage *found)
{
	struct error e;
	*s = (struct replay){0};
	return journal_open(j, temporary_folder, JOB, GENERATION, check_item, s, found, &e);
}

static void get_journal_path(char path[512])
{
	snprintf(path, 512, "%s/journal.%d", temporary_folder, GENERATION);
}

static void all_records_are_read_back(void **state)
{
	(void)state;
	uint64_t ends[RECORDS + 1];
	struct journal_damage found;
	struct journal *j;
	struct replay s;
	write_journal(ends);
	assert_int_equal(reopen_journal(&j, &s, &found), 0);
	assert_int_equal(s.count, RECORDS);
	assert_false(s.is_wrong);
	assert_int_equal(found.cut_bytes, 0);
	assert_int_equal(journal_bytes(j), ends[RECORDS]);
	journal_release(j);
}

/* The file is cut at every byte: the records before the cut are read, another one can be appended, and nothing of the
 * torn record is seen again. */
static void torn_record_is_dropped_wherever_it_was_cut(void **state)
{
	(void)state;
	uint64_t ends[RECORDS + 1];
	struct journal_damage found;
	char path[512];
	get_journal_path(path);
	write_journal(ends);
	for (uint64_t length = ends[RECORDS]; length >= ends[0]; length--) {
		struct journal *j;
		struct replay s;
		unsigned whole_count = 0;
		write_journal(ends);
		assert_int_equal(truncate(path, (off_t)length), 0);
		while (whole_count < RECORDS && ends[whole_count + 1] <= length)
			whole_count++;
		assert_int_equal(reopen_journal(&j, &s, &found), 0);
		assert_int_equal(s.count, whole_count);
		assert_false(s.is_wrong);
		assert_int_equal(found.cut_bytes, length - ends[whole_count]);
		for (unsigned i = whole_count; i < RECORDS; i++)
			append_record(j, i);
		journal_release(j);
		assert_int_equal(reopen_journal(&j, &s, &found), 0);
		assert_int_equal(s.count, RECORDS);
		assert_false(s.is_wrong);
		journal_release(j);
	}
}

/* The file grew before its bytes were written: the kernel shows zeros. */
static void zeros_behind_the_records_are_cut(void **state)
{
	(void)state;
	uint64_t ends[RECORDS + 1];
	struct journal_damage found;
	char path[512];
	struct journal *j;
	struct replay s;
	get_journal_path(path);
	write_journal(ends);
	assert_int_equal(truncate(path, (off_t)ends[RECORDS] + 100), 0);
	assert_int_equal(reopen_journal(&j, &s, &found), 0);
	assert_int_equal(s.count, RECORDS);
	assert_int_equal(found.cut_bytes, 100);
	journal_release(j);
}

static void flip_bit(const char *path, uint64_t offset, unsigned bit)
{
	unsigned char c;
	int fd = open(path, O_RDWR);
	assert_true(fd >= 0);
	assert_int_equal(pread(fd, &c, 1, (off_t)offset), 1);
	c = (unsigned char)(c ^ 1u << bit);
	assert_int_equal(pwrite(fd, &c, 1, (off_t)offset), 1);
	close(fd);
}

/* One bit of any byte is flipped: the record that it belongs to is missing, and no other; if it is the last record, it
 * may also count as torn. A damaged head of the file is made anew. All this again after everything was copied into a
 * new file. */
static void flipped_bit_costs_one_record(void **state)
{
	(void)state;
	uint64_t ends[RECORDS + 1];
	struct journal_damage found;
	char path[512];
	get_journal_path(path);
	write_journal(ends);
	for (uint64_t offset = 0; offset < ends[RECORDS]; offset++) {
		struct journal *j;
		struct replay s;
		struct error e;
		unsigned damaged = 0;
		write_journal(ends);
		flip_bit(path, offset, (unsigned)(offset % 8));
		while (ends[damaged + 1] <= offset)
			damaged++;
		bool head = offset < ends[0], torn = damaged == RECORDS - 1;
		for (int again = 0; again < 2; again++) {
			int rc = reopen_journal(&j, &s, &found);
			if (rc == -EPROTO && offset >= 5 && offset < 8) /* the digits of the version */
				break;
			assert_int_equal(rc, 0);
			assert_int_equal(s.count, torn ? RECORDS - 1 : RECORDS);
			assert_int_equal(s.missing_count, !head && !torn);
			assert_true(found.damaged_count == s.missing_count && found.lost_count == s.missing_count);
			assert_int_equal(s.known_lease_count,
					 s.missing_count && offset >= ends[damaged + 1] - sizes[damaged]);
			assert_int_equal(found.cut_bytes, torn && !again ? ends[RECORDS] - ends[RECORDS - 1] : 0);
			assert_false(s.is_wrong);
			unsigned char *body;
			size_t size;
			for (unsigned i = 0; !head && i < RECORDS; i++)
				if (i != damaged &&
				    journal_read_body(j, s.missing_count && i > damaged ? s.offsets[i] : ends[i], &body,
						      &size, &e) == 0) {
					assert_int_equal(size, sizes[i]);
					free(body);
				} else {
					assert_int_equal(i, damaged);
				}
			assert_int_equal(journal_renew(j, &e), 0);
			journal_release(j);
		}
	}
}

/* Bytes are wrong across the borders of records: the records that they belong to are missing, all others are there, and
 * more can be appended. */
static void damaged_range_costs_only_its_records(void **state)
{
	(void)state;
	unsigned char bytes[400];
	uint64_t ends[RECORDS + 1];
	struct journal_damage found;
	char path[512];
	get_journal_path(path);
	write_journal(ends);
	for (uint64_t from = ends[0]; from < ends[RECORDS - 1]; from += 7)
		for (uint64_t to = from + 1; to <= ends[RECORDS - 1] && to - from <= sizeof bytes; to += 13) {
			struct journal *j;
			struct replay s;
			unsigned first = 0, last = 0;
			write_journal(ends);
			int fd = open(path, O_RDWR);
			assert_int_equal(pread(fd, bytes, to - from, (off_t)from), to - from);
			for (uint64_t i = 0; i < to - from; i++)
				bytes[i] = (unsigned char)~bytes[i];
			assert_int_equal(pwrite(fd, bytes, to - from, (off_t)from), to - from);
			close(fd);
			while (ends[first + 1] <= from)
				first++;
			while (ends[last + 1] < to)
				last++;
			assert_int_equal(reopen_journal(&j, &s, &found), 0);
			assert_int_equal(s.count, RECORDS);
			assert_int_equal(s.missing_count, last - first + 1);
			assert_int_equal(found.lost_count, s.missing_count);
			assert_false(s.is_wrong);
			journal_release(j);
		}
}

/* The worker that makes a result puts forged records into it: none of them is believed. */
static void forged_record_inside_a_record_is_not_believed(void **state)
{
	(void)state;
	struct journal *j, *other;
	struct replay s;
	struct error e;
	struct journal_damage found;
	unsigned char forged[200];
	char path[512];
	uint64_t ends[RECORDS + 1];
	write_journal(ends);
	get_journal_path(path);
	int fd = open(path, O_RDONLY);
	assert_int_equal(pread(fd, forged, sizeof forged, (off_t)ends[0]), sizeof forged);
	close(fd);
	assert_int_equal(journal_create(&other, temporary_folder, JOB, GENERATION, &e), 0);
	for (int i = 0; i < 3; i++) {
		assert_int_equal(journal_append(other, JOURNAL_BATCH, NULL, 1 + i, forged, sizeof forged, NULL, &e), 0);
		assert_int_equal(journal_sync(other, &e), 0);
	}
	journal_release(other);
	flip_bit(path, ends[0] + 3, 1); /* damages the head of the first record, so that the reader searches for the
					 * next one */
	assert_int_equal(reopen_journal(&j, &s, &found), 0);
	assert_true(s.count == 3 && s.missing_count == 1 && s.known_lease_count == 0 && found.lost_count == 1);
	assert_int_equal(s.offsets[1], ends[0] + (ends[1] - ends[0] - sizes[0]) + sizeof forged);
	journal_release(j);
}

static void journal_of_another_job_is_refused(void **state)
{
	(void)state;
	uint64_t ends[RECORDS + 1];
	struct journal_damage found;
	struct journal *j;
	struct replay s = {0};
	struct error e;
	char path[512], other[512];
	write_journal(ends);
	assert_int_equal(journal_open(&j, temporary_folder, JOB + 1, GENERATION, check_item, &s, &found, &e), -EBADMSG);
	assert_int_equal(journal_open(&j, temporary_folder, JOB, GENERATION + 1, check_item, &s, &found, &e), -ENOENT);
	get_journal_path(path);
	snprintf(other, sizeof other, "%s/journal.%d", temporary_folder, GENERATION + 1);
	assert_int_equal(rename(path, other), 0);
	assert_int_equal(journal_open(&j, temporary_folder, JOB, GENERATION + 1, check_item, &s, &found, &e), -EBADMSG);
	assert_int_equal(s.count, 0);
}

static unsigned remaining_reads, read_errno;

static ssize_t fail_pread_when_used_up(int fd, void *bytes, size_t size, off_t offset)
{
	if (remaining_reads-- > 0)
		return pread(fd, bytes, size, offset);
	errno = (int)read_errno;
	return -1;
}

/* Each read fails in turn: that is reported as an error, not as the end of the journal, and the next attempt reads all
 * records. */
static void read_errors_cut_nothing(void **state)
{
	(void)state;
	uint64_t ends[RECORDS + 1];
	struct journal_damage found;
	struct disk failing = disk_system;
	failing.pread = fail_pread_when_used_up;
	write_journal(ends);
	for (unsigned n = 0;; n++) {
		struct journal *j;
		struct replay s;
		remaining_reads = n;
		read_errno = n % 2 ? EIO : ENOMEM;
		disk_set_calls(&failing);
		int rc = reopen_journal(&j, &s, &found);
		disk_set_calls(NULL);
		if (rc == 0) {
			assert_true(n > RECORDS);
			journal_release(j);
			return;
		}
		assert_int_equal(rc, -(int)read_errno);
		assert_int_equal(found.cut_bytes, 0);
		assert_int_equal(reopen_journal(&j, &s, &found), 0);
		assert_int_equal(s.count, RECORDS);
		assert_int_equal(found.cut_bytes, 0);
		journal_release(j);
	}
}

/* Each read fails in turn while the journal is copied: each time a sentence says so, and finally the copy succeeds. */
static void read_errors_during_a_renewal_are_reported(void **state)
{
	(void)state;
	uint64_t ends[RECORDS + 1];
	struct journal_damage found;
	struct journal *j;
	struct replay s;
	struct disk failing = disk_system;
	failing.pread = fail_pread_when_used_up;
	write_journal(ends);
	assert_int_equal(reopen_journal(&j, &s, &found), 0);
	journal_mark_bad(j);
	int rc = -1;
	unsigned n = 0;
	read_errno = EIO;
	for (; rc; n++) {
		struct error e = {""};
		remaining_reads = n;
		disk_set_calls(&failing);
		rc = journal_renew(j, &e);
		disk_set_calls(NULL);
		assert_true(rc == 0 || (rc == -EIO && strstr(e.text, "journal.") && journal_is_bad(j)));
	}
	assert_true(n > 2 * RECORDS && !journal_is_bad(j));
	journal_release(j);
}

/* A file of another version, whatever follows its name, is left alone, and the sentence names its version. */
static void journal_of_another_version_is_refused(void **state)
{
	(void)state;
	uint64_t ends[RECORDS + 1];
	struct journal_damage found;
	char path[512];
	struct journal *j;
	struct replay s = {0};
	struct error e;
	struct stat before, after;
	get_journal_path(path);
	write_journal(ends);
	int fd = open(path, O_RDWR);
	assert_int_equal(pwrite(fd, "072 another head", 16, 5), 16);
	close(fd);
	assert_int_equal(stat(path, &before), 0);
	assert_int_equal(journal_open(&j, temporary_folder, JOB, GENERATION, check_item, &s, &found, &e), -EPROTO);
	assert_non_null(strstr(e.text, "version 072"));
	assert_int_equal(stat(path, &after), 0);
	assert_int_equal(before.st_size, after.st_size);
}

static void journals_of_other_generations_are_deleted(void **state)
{
	(void)state;
	uint64_t ends[RECORDS + 1];
	struct journal *j;
	struct error e;
	char path[512];
	write_journal(ends);
	assert_int_equal(journal_create(&j, temporary_folder, JOB, 4, &e), 0);
	journal_release(j);
	journal_delete_others(temporary_folder, 4);
	get_journal_path(path);
	assert_int_equal(access(path, F_OK), -1);
	snprintf(path, sizeof path, "%s/journal.4", temporary_folder);
	assert_int_equal(access(path, F_OK), 0);
	journal_delete_others(temporary_folder, UINT64_MAX);
	assert_int_equal(access(path, F_OK), -1);
}

/* The disk is full: earlier records stay, and records appended meanwhile are written once there is room, into a new
 * file, since the old one is no longer trusted. */
static void full_disk_loses_no_record(void **state)
{
	(void)state;
	uint64_t ends[RECORDS + 1];
	struct journal_damage found;
	struct journal *j;
	struct replay s;
	struct error e;
	struct rlimit old, small;
	write_journal(ends);
	assert_int_equal(reopen_journal(&j, &s, &found), 0);
	assert_int_equal(getrlimit(RLIMIT_FSIZE, &old), 0);
	signal(SIGXFSZ, SIG_IGN);
	small = (struct rlimit){ends[RECORDS] + 40, old.rlim_max};
	assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
	char body[100] = {0};
	assert_int_equal(journal_append(j, JOURNAL_BATCH, NULL, 9, body, sizeof body, NULL, &e), 0);
	assert_false(journal_is_bad(j));
	assert_int_equal(journal_sync(j, &e), -EFBIG);
	assert_true(journal_is_bad(j));
	assert_int_equal(journal_renew(j, &e), -EFBIG);
	assert_int_equal(setrlimit(RLIMIT_FSIZE, &old), 0);
	assert_int_equal(journal_sync(j, &e), -EFBIG); /* no longer the state of the disk, but the original cause */
	assert_int_equal(journal_write(j, &e), -EFBIG);
	assert_int_equal(journal_reserve(j, 1, &e), -EIO); /* free space does not help against this */
	assert_non_null(strstr(e.text, "File too large"));
	struct journal *other;
	assert_int_equal(reopen_journal(&other, &s, &found), 0);
	assert_int_equal(s.count, RECORDS);
	assert_int_equal(found.cut_bytes, 0);
	journal_release(other);
	assert_int_equal(journal_append(j, JOURNAL_BATCH, NULL, 10, body, 3, NULL, &e), 0);
	assert_int_equal(journal_renew(j, &e), 0);
	assert_false(journal_is_bad(j));
	assert_int_equal(journal_sync(j, &e), 0);
	uint64_t bytes = journal_bytes(j);
	assert_true(bytes > ends[RECORDS] + sizeof body);
	journal_release(j);
	assert_int_equal(reopen_journal(&j, &s, &found), 0);
	assert_int_equal(s.count, RECORDS + 2);
	assert_int_equal(journal_bytes(j), bytes);
	journal_release(j);
}

/*
 * Power is lost: of the bytes written after the last journal_sync any sectors may be missing, in any order, and the
 * file may have any length that it had since. All synced records are there, and some of the others, unchanged.
 */
static void synced_records_survive_a_loss_of_power(void **state)
{
	(void)state;
	enum { RUNS = 400, SECTOR = 16 };
	char path[512];
	uint32_t random_state = 12345;
	uint64_t holes = 0;
	get_journal_path(path);
	for (int run = 0; run < RUNS; run++) {
		struct journal *j;
		struct replay s;
		struct error e;
		uint64_t ends[RECORDS + 1];
		struct journal_damage found;
		unsigned synced = (unsigned)run % (RECORDS + 1);
		assert_int_equal(journal_create(&j, temporary_folder, JOB, GENERATION, &e), 0);
		ends[0] = journal_bytes(j);
		for (unsigned i = 0; i < RECORDS; i++) {
			append_record(j, i);
			ends[i + 1] = journal_bytes(j);
			if (i + 1 == synced)
				assert_int_equal(journal_sync(j, &e), 0);
		}
		journal_release(j);
		int fd = open(path, O_RDWR);
		uint64_t from = ends[synced], end = ends[RECORDS];
		static const char zeros[SECTOR];
		for (uint64_t offset = from; offset < end; offset += SECTOR) {
			random_state = random_state * 1664525u + 1013904223u;
			size_t n = end - offset < SECTOR ? end - offset : SECTOR;
			if (random_state >> 30 == 0)
				assert_int_equal(pwrite(fd, zeros, n, (off_t)offset), n);
		}
		random_state = random_state * 1664525u + 1013904223u;
		if (random_state >> 31)
			assert_int_equal(ftruncate(fd, (off_t)(from + random_state % (end - from + 1))), 0);
		close(fd);
		assert_int_equal(reopen_journal(&j, &s, &found), 0);
		assert_true(s.count >= synced);
		assert_false(s.is_wrong);
		assert_int_equal(found.lost_count, 0); /* a missing record before others was never durable */
		assert_int_equal(found.damaged_count, s.missing_count);
		assert_int_equal(journal_bytes(j), ends[s.count]);
		holes += s.missing_count;
		journal_release(j);
	}
	assert_true(holes > 10);
}

/* Test vectors of RFC 3720, appendix B.4. */
static void checksum_matches_its_test_vectors(void **state)
{
	(void)state;
	unsigned char zeros[32] = {0}, ones[32], up[32];
	memset(ones, 255, sizeof ones);
	for (int i = 0; i < 32; i++)
		up[i] = (unsigned char)i;
	assert_int_equal(crc32c(0, zeros, 32), 0x8A9136AAu);
	assert_int_equal(crc32c(0, ones, 32), 0x62A8AB43u);
	assert_int_equal(crc32c(0, up, 32), 0x46DD794Eu);
	assert_int_equal(crc32c(crc32c(0, up, 13), up + 13, 19), 0x46DD794Eu);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(checksum_matches_its_test_vectors),
		cmocka_unit_test_setup_teardown(all_records_are_read_back, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(torn_record_is_dropped_wherever_it_was_cut, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(zeros_behind_the_records_are_cut, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(flipped_bit_costs_one_record, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(damaged_range_costs_only_its_records, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(forged_record_inside_a_record_is_not_believed, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(journal_of_another_job_is_refused, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(read_errors_during_a_renewal_are_reported, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(read_errors_cut_nothing, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(journal_of_another_version_is_refused, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(journals_of_other_generations_are_deleted, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(synced_records_survive_a_loss_of_power, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(full_disk_loses_no_record, temporary_folder_set_up,
						temporary_folder_tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
