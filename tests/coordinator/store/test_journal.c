/* A journal gives back what was appended and whole, wherever the machine stopped and whatever bit fell over. */
#include "coordinator/store/journal.h"
#include "common/base/crc.h"
#include "common/base/disk.h"
#include "tests/support/folder.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <fcntl.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <signal.h>
#include <unistd.h>

enum { RECORDS = 5, JOB = 12, GENERATION = 3 };

static const size_t sizes[RECORDS] = {17, 0, 1, 64, 9};

struct seen {
	unsigned count;
	double elapsed;
	bool wrong;
};

static unsigned char byte_of(unsigned record, size_t i)
{
	return (unsigned char)(31 * record + 7 * i + 1);
}

static int see(void *user, enum journal_kind kind, double elapsed, const unsigned char *body, size_t size, struct error *e)
{
	struct seen *s = user;
	(void)e;
	s->wrong |= s->count >= RECORDS || kind != (enum journal_kind)(1 + s->count % 3) || size != sizes[s->count] || elapsed <= s->elapsed;
	for (size_t i = 0; i < size && !s->wrong; i++)
		s->wrong |= body[i] != byte_of(s->count, i);
	s->elapsed = elapsed;
	s->count++;
	return 0;
}

static void append(struct journal *j, unsigned record)
{
	unsigned char body[64];
	struct error e;
	for (size_t i = 0; i < sizes[record]; i++)
		body[i] = byte_of(record, i);
	size_t first = sizes[record] / 3;
	struct buf rest = {.limit = sizes[record]};
	assert_true(buf_append(&rest, body + first, sizes[record] - first));
	assert_int_equal(journal_append(j, (enum journal_kind)(1 + record % 3), 0.5 + record, body, first, &rest, &e), 0);
	assert_null(rest.bytes);
}

/* bytes of the file after each record; [0]: without any */
static void write_all(uint64_t ends[RECORDS + 1])
{
	struct journal *j;
	struct error e;
	assert_int_equal(journal_create(&j, folder, JOB, GENERATION, &e), 0);
	ends[0] = journal_bytes(j);
	for (unsigned i = 0; i < RECORDS; i++) {
		append(j, i);
		ends[i + 1] = journal_bytes(j);
	}
	assert_int_equal(journal_sync(j, &e), 0);
	journal_release(j);
}

static int open_again(struct journal **j, struct seen *s, uint64_t *cut)
{
	struct error e;
	*s = (struct seen){0};
	return journal_open(j, folder, JOB, GENERATION, see, s, cut, &e);
}

static void path_of(char path[512])
{
	snprintf(path, 512, "%s/journal.%d", folder, GENERATION);
}

static void all_comes_back(void **state)
{
	(void)state;
	uint64_t ends[RECORDS + 1], cut;
	struct journal *j;
	struct seen s;
	write_all(ends);
	assert_int_equal(open_again(&j, &s, &cut), 0);
	assert_int_equal(s.count, RECORDS);
	assert_false(s.wrong);
	assert_int_equal(cut, 0);
	assert_int_equal(journal_bytes(j), ends[RECORDS]);
	journal_release(j);
}

/* Cut at every byte: the records before it are there, one more can be appended, and nothing of the torn one is seen again. */
static void torn_at_every_byte(void **state)
{
	(void)state;
	uint64_t ends[RECORDS + 1], cut;
	char path[512];
	path_of(path);
	write_all(ends);
	for (uint64_t length = ends[RECORDS]; length >= ends[0]; length--) {
		struct journal *j;
		struct seen s;
		unsigned whole = 0;
		write_all(ends);
		assert_int_equal(truncate(path, (off_t)length), 0);
		while (whole < RECORDS && ends[whole + 1] <= length)
			whole++;
		assert_int_equal(open_again(&j, &s, &cut), 0);
		assert_int_equal(s.count, whole);
		assert_false(s.wrong);
		assert_int_equal(cut, length - ends[whole]);
		for (unsigned i = whole; i < RECORDS; i++)
			append(j, i);
		journal_release(j);
		assert_int_equal(open_again(&j, &s, &cut), 0);
		assert_int_equal(s.count, RECORDS);
		assert_false(s.wrong);
		journal_release(j);
	}
}

/* A file that grew before its bytes were written: the kernel shows zeros. */
static void zeros_behind(void **state)
{
	(void)state;
	uint64_t ends[RECORDS + 1], cut;
	char path[512];
	struct journal *j;
	struct seen s;
	path_of(path);
	write_all(ends);
	assert_int_equal(truncate(path, (off_t)ends[RECORDS] + 100), 0);
	assert_int_equal(open_again(&j, &s, &cut), 0);
	assert_int_equal(s.count, RECORDS);
	assert_int_equal(cut, 100);
	journal_release(j);
}

static void flip(const char *path, uint64_t at, unsigned bit)
{
	unsigned char c;
	int fd = open(path, O_RDWR);
	assert_true(fd >= 0);
	assert_int_equal(pread(fd, &c, 1, (off_t)at), 1);
	c = (unsigned char)(c ^ 1u << bit);
	assert_int_equal(pwrite(fd, &c, 1, (off_t)at), 1);
	close(fd);
}

/* Any bit of any byte: what was before it is seen, and nothing wrong ever; the head's bits make it nobody's journal. */
static void one_bit_wrong(void **state)
{
	(void)state;
	uint64_t ends[RECORDS + 1], cut;
	char path[512];
	path_of(path);
	write_all(ends);
	for (uint64_t at = 0; at < ends[RECORDS]; at++) {
		struct journal *j;
		struct seen s;
		unsigned whole = 0;
		write_all(ends);
		flip(path, at, (unsigned)(at % 8));
		while (whole < RECORDS && ends[whole + 1] <= at)
			whole++;
		int rc = open_again(&j, &s, &cut);
		if (at < ends[0] - 4) { /* its last 4 bytes mean nothing */
			assert_true(rc == -EBADMSG || (rc == -EPROTO && at >= 5 && at < 8)); /* the digits of its version */
			continue;
		}
		assert_int_equal(rc, 0);
		assert_int_equal(s.count, at < ends[0] ? RECORDS : whole);
		assert_false(s.wrong);
		journal_release(j);
	}
}

static void of_another_job(void **state)
{
	(void)state;
	uint64_t ends[RECORDS + 1], cut;
	struct journal *j;
	struct seen s = {0};
	struct error e;
	char path[512], other[512];
	write_all(ends);
	assert_int_equal(journal_open(&j, folder, JOB + 1, GENERATION, see, &s, &cut, &e), -EBADMSG);
	assert_int_equal(journal_open(&j, folder, JOB, GENERATION + 1, see, &s, &cut, &e), -ENOENT);
	path_of(path);
	snprintf(other, sizeof other, "%s/journal.%d", folder, GENERATION + 1);
	assert_int_equal(rename(path, other), 0);
	assert_int_equal(journal_open(&j, folder, JOB, GENERATION + 1, see, &s, &cut, &e), -EBADMSG);
	assert_int_equal(s.count, 0);
}

static unsigned reads_left, failing_with;

static ssize_t failing_pread(int fd, void *bytes, size_t size, off_t at)
{
	if (reads_left-- > 0)
		return pread(fd, bytes, size, at);
	errno = (int)failing_with;
	return -1;
}

/* One read after the other fails: that is an error, not the end of the journal, and the next reading finds all. */
static void read_errors_cut_nothing(void **state)
{
	(void)state;
	uint64_t ends[RECORDS + 1], cut;
	struct disk failing = disk_system;
	failing.pread = failing_pread;
	write_all(ends);
	for (unsigned n = 0;; n++) {
		struct journal *j;
		struct seen s;
		reads_left = n;
		failing_with = n % 2 ? EIO : ENOMEM;
		disk_use(&failing);
		int rc = open_again(&j, &s, &cut);
		disk_use(NULL);
		if (rc == 0) {
			assert_true(n > RECORDS);
			journal_release(j);
			return;
		}
		assert_int_equal(rc, -(int)failing_with);
		assert_int_equal(cut, 0);
		assert_int_equal(open_again(&j, &s, &cut), 0);
		assert_int_equal(s.count, RECORDS);
		assert_int_equal(cut, 0);
		journal_release(j);
	}
}

/* Whatever it looks like behind the name: it is left alone, and the sentence says of which version it is. */
static void of_another_version(void **state)
{
	(void)state;
	uint64_t ends[RECORDS + 1], cut;
	char path[512];
	struct journal *j;
	struct seen s = {0};
	struct error e;
	struct stat before, after;
	path_of(path);
	write_all(ends);
	int fd = open(path, O_RDWR);
	assert_int_equal(pwrite(fd, "072 another head", 16, 5), 16);
	close(fd);
	assert_int_equal(stat(path, &before), 0);
	assert_int_equal(journal_open(&j, folder, JOB, GENERATION, see, &s, &cut, &e), -EPROTO);
	assert_non_null(strstr(e.text, "version 072"));
	assert_int_equal(stat(path, &after), 0);
	assert_int_equal(before.st_size, after.st_size);
}

static void others_are_cleared(void **state)
{
	(void)state;
	uint64_t ends[RECORDS + 1];
	struct journal *j;
	struct error e;
	char path[512];
	write_all(ends);
	assert_int_equal(journal_create(&j, folder, JOB, 4, &e), 0);
	journal_release(j);
	journal_clear(folder, 4);
	path_of(path);
	assert_int_equal(access(path, F_OK), -1);
	snprintf(path, sizeof path, "%s/journal.4", folder);
	assert_int_equal(access(path, F_OK), 0);
	journal_clear(folder, UINT64_MAX);
	assert_int_equal(access(path, F_OK), -1);
}

/* A disk that takes no more: what was there stays, and what was appended comes when there is room, in a new file: the old one is
 * not believed again. */
static void no_room(void **state)
{
	(void)state;
	uint64_t ends[RECORDS + 1], cut;
	struct journal *j;
	struct seen s;
	struct error e;
	struct rlimit old, small;
	write_all(ends);
	assert_int_equal(open_again(&j, &s, &cut), 0);
	assert_int_equal(getrlimit(RLIMIT_FSIZE, &old), 0);
	signal(SIGXFSZ, SIG_IGN);
	small = (struct rlimit){ends[RECORDS] + 40, old.rlim_max};
	assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
	char body[100] = {0};
	assert_int_equal(journal_append(j, JOURNAL_BATCH, 9, body, sizeof body, NULL, &e), 0);
	assert_false(journal_is_bad(j));
	assert_int_equal(journal_sync(j, &e), -EFBIG);
	assert_true(journal_is_bad(j));
	assert_int_equal(journal_renew(j, &e), -EFBIG);
	assert_int_equal(setrlimit(RLIMIT_FSIZE, &old), 0);
	assert_true(journal_sync(j, &e) != 0 && journal_reserve(j, 1, &e) != 0);
	struct journal *other;
	assert_int_equal(open_again(&other, &s, &cut), 0);
	assert_int_equal(s.count, RECORDS);
	assert_int_equal(cut, 0);
	journal_release(other);
	assert_int_equal(journal_append(j, JOURNAL_BATCH, 10, body, 3, NULL, &e), 0);
	assert_int_equal(journal_renew(j, &e), 0);
	assert_false(journal_is_bad(j));
	assert_int_equal(journal_sync(j, &e), 0);
	uint64_t bytes = journal_bytes(j);
	assert_true(bytes > ends[RECORDS] + sizeof body);
	journal_release(j);
	assert_int_equal(open_again(&j, &s, &cut), 0);
	assert_int_equal(s.count, RECORDS + 2);
	assert_int_equal(journal_bytes(j), bytes);
	journal_release(j);
}

static off_t length_of_file(void)
{
	char path[512];
	struct stat st;
	path_of(path);
	assert_int_equal(stat(path, &st), 0);
	return st.st_size;
}

static struct buf piece(size_t size)
{
	struct buf b = {.limit = size};
	assert_true(buf_reserve(&b, size));
	b.size = size;
	return b;
}

/* What is appended goes to the disk with the flush, or when it is too much of all journals to be kept in memory. */
static void memory_is_bounded(void **state)
{
	(void)state;
	enum { PIECE = 1 << 24, MOST = 1 << 28 };
	struct journal *j, *other;
	struct error e;
	struct buf b = piece(PIECE);
	assert_int_equal(journal_create(&other, folder, JOB, GENERATION + 1, &e), 0);
	assert_int_equal(journal_append(other, JOURNAL_BATCH, 1, "", 0, &b, &e), 0);
	assert_int_equal(journal_create(&j, folder, JOB, GENERATION, &e), 0);
	off_t empty = length_of_file();
	for (unsigned n = 1; n < MOST / PIECE; n++) { /* with their heads it is a little more */
		b = piece(PIECE);
		assert_int_equal(length_of_file(), empty);
		assert_int_equal(journal_append(j, JOURNAL_BATCH, 1, "", 0, &b, &e), 0);
	}
	off_t written = length_of_file();
	assert_true(written > empty + MOST - PIECE);
	assert_int_equal(journal_bytes(j), written);
	assert_int_equal(journal_append(j, JOURNAL_BATCH, 1, "more", 4, NULL, &e), 0);
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
		assert_int_equal(journal_append(at_hand, JOURNAL_BATCH, 1, "more", 4, NULL, &e), 0);
	return pwritev(fd, parts, count, at);
}

/* While it is written more and more is appended: the flush does not wait for the last of it. */
static void a_flush_comes_to_an_end(void **state)
{
	(void)state;
	struct disk busy = disk_system;
	struct error e;
	busy.pwritev = appending_pwritev;
	assert_int_equal(journal_create(&at_hand, folder, JOB, GENERATION, &e), 0);
	assert_int_equal(journal_append(at_hand, JOURNAL_BATCH, 1, "first", 5, NULL, &e), 0);
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

/* A record for which there is no room takes nothing from those that are appended and not written yet. */
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
	assert_int_equal(journal_append(j, JOURNAL_BATCH, 1, body, 500, NULL, &e), 0);
	assert_int_equal(journal_reserve(j, 900, &e), -ENOSPC);
	assert_int_equal(room_end, journal_bytes(j));
	assert_int_equal(journal_sync(j, &e), 0);
	disk_use(NULL);
	journal_release(j);
}

/*
 * Power lost: of what was written after the last journal_sync any sectors may be missing, in any order, and the file may be as long as
 * it was at any time since. All that was synced is there, and of the rest some first records, unchanged.
 */
static void power_lost(void **state)
{
	(void)state;
	enum { RUNS = 400, SECTOR = 16 };
	char path[512];
	uint32_t dice = 12345;
	path_of(path);
	for (int run = 0; run < RUNS; run++) {
		struct journal *j;
		struct seen s;
		struct error e;
		uint64_t ends[RECORDS + 1], cut;
		unsigned synced = (unsigned)run % (RECORDS + 1);
		assert_int_equal(journal_create(&j, folder, JOB, GENERATION, &e), 0);
		ends[0] = journal_bytes(j);
		for (unsigned i = 0; i < RECORDS; i++) {
			append(j, i);
			ends[i + 1] = journal_bytes(j);
			if (i + 1 == synced)
				assert_int_equal(journal_sync(j, &e), 0);
		}
		journal_release(j);
		int fd = open(path, O_RDWR);
		uint64_t from = ends[synced], end = ends[RECORDS];
		static const char zeros[SECTOR];
		for (uint64_t at = from; at < end; at += SECTOR) {
			dice = dice * 1664525u + 1013904223u;
			size_t n = end - at < SECTOR ? end - at : SECTOR;
			if (dice >> 30 == 0)
				assert_int_equal(pwrite(fd, zeros, n, (off_t)at), n);
		}
		dice = dice * 1664525u + 1013904223u;
		if (dice >> 31)
			assert_int_equal(ftruncate(fd, (off_t)(from + dice % (end - from + 1))), 0);
		close(fd);
		assert_int_equal(open_again(&j, &s, &cut), 0);
		assert_true(s.count >= synced);
		assert_false(s.wrong);
		assert_int_equal(journal_bytes(j), ends[s.count]);
		journal_release(j);
	}
}

/* RFC 3720, B.4 */
static void checksums(void **state)
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
		cmocka_unit_test(checksums),
		cmocka_unit_test_setup_teardown(all_comes_back, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(torn_at_every_byte, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(zeros_behind, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(one_bit_wrong, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(of_another_job, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(read_errors_cut_nothing, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(of_another_version, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(others_are_cleared, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(power_lost, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(memory_is_bounded, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(a_flush_comes_to_an_end, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(promised_room_is_kept, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(no_room, folder_set_up, folder_tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
