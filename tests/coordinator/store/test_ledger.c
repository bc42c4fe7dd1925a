/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The database of jobs (coordinator/store/ledger.h): rows survive closing and opening, ended jobs keep what they must
 * and no more, ids are never given twice, notes and checksums stay what they are, databases of earlier versions are
 * read and of later ones refused, and the file stays small while jobs come and go.
 */
#include "coordinator/store/ledger.h"

#include "common/base/mem.h"
#include "common/base/text.h"
#include "tests/support/bytes_read.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/ledger_files.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <arpa/inet.h>
#include <fcntl.h>
#include <sqlite3.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static struct error e;

static struct ledger *open_ledger(void)
{
	struct ledger *l;
	assert_int_equal(ledger_open(&l, temporary_folder, &e), 0);
	return l;
}

/* Returns 1 and the next live job after that id, or 0 if there is none. */
static int next_live(struct ledger *l, uint64_t after, struct ledger_job *j)
{
	uint64_t *ids;
	size_t count;
	assert_int_equal(ledger_list_ids(l, LEDGER_LIVE, &ids, &count, &e), 0);
	uint64_t id = 0;
	for (size_t i = 0; i < count && !id; i++)
		id = ids[i] > after ? ids[i] : 0;
	mem_free(ids);
	return id ? ledger_read_row(l, id, j, &e) : 0;
}

static struct job_record *make_record(uint64_t id, uint64_t extended, const char *state)
{
	static struct job_record r;
	record_init(&r, id, "a 'name'", "7");
	r.extended = extended;
	text_copy(r.state, sizeof r.state, state);
	return &r;
}

static void add_job(struct ledger *l, uint64_t id)
{
	static const unsigned char submission[] = {0, 1, 0, 255}, plan[] = {9, 0};
	struct ledger_job j = {.id = id,
			       .owner = "7",
			       .name = "a 'name'",
			       .version = "0.1",
			       .priority = -3,
			       .is_mixed = true,
			       .submitted = 12.5,
			       .record = "",
			       .submission = submission,
			       .submission_size = sizeof submission,
			       .plan = plan,
			       .plan_size = sizeof plan};
	assert_int_equal(ledger_add(l, &j, &e), 0);
}

/* Memory runs out while a submission is copied: then the row is not written at all. */
static void lack_of_memory_writes_no_row(void **state)
{
	(void)state;
	enum { SIZE = 8 << 20 };
	struct ledger_job j;
	struct ledger *l = open_ledger();
	add_job(l, 1);
	unsigned char *submission = mem_alloc(SIZE, 1);
	assert_non_null(submission);
	const struct ledger_job large = {.id = 2,
					 .owner = "7",
					 .name = "large",
					 .version = "0.1",
					 .record = "",
					 .submission = submission,
					 .submission_size = SIZE};
	j = large;
	sqlite3_hard_heap_limit64(sqlite3_memory_used() + SIZE / 2);
	int rc = ledger_add(l, &j, &e);
	sqlite3_hard_heap_limit64(0);
	assert_int_equal(rc, -ENOMEM);
	assert_int_equal(ledger_read_row(l, 2, &j, &e), 0);
	j = large;
	assert_int_equal(ledger_add(l, &j, &e), 0);
	assert_int_equal(ledger_read_row(l, 2, &j, &e), 1);
	assert_true(!j.is_damaged && j.submission_size == SIZE);
	ledger_close(l);
	mem_free(submission);
}

static void live_jobs_survive_reopening(void **state)
{
	(void)state;
	struct ledger_job j;
	struct ledger *l = open_ledger();
	assert_int_equal(next_live(l, 0, &j), 0);
	for (uint64_t id = 1; id <= 3; id++)
		add_job(l, id);
	assert_int_equal(ledger_end_job(l, make_record(2, 0, "done"), false, &e), 0);
	ledger_close(l);
	l = open_ledger();
	assert_int_equal(next_live(l, 0, &j), 1);
	assert_int_equal(j.id, 1);
	assert_string_equal(j.owner, "7");
	assert_string_equal(j.name, "a 'name'");
	assert_string_equal(j.version, "0.1");
	assert_int_equal(j.priority, -3);
	assert_true(j.is_mixed && j.submitted == 12.5);
	assert_int_equal(j.submission_size, 4);
	assert_memory_equal(j.submission, "\0\1\0\377", 4);
	assert_int_equal(j.plan_size, 2);
	assert_memory_equal(j.plan, "\11\0", 2);
	assert_int_equal(next_live(l, 1, &j), 1);
	assert_int_equal(j.id, 3);
	assert_int_equal(next_live(l, 3, &j), 0);
	assert_int_equal(ledger_ended_count(l), 1);
	assert_int_equal(ledger_delete_ended(l, (uint64_t[]){7, 3}, 2, &e), 0);
	assert_int_equal(ledger_ended_count(l), 1);
	assert_int_equal(ledger_read_row(l, 2, &j, &e), 1);
	assert_int_equal(ledger_delete_ended(l, (uint64_t[]){2, 3}, 2, &e), 0);
	assert_int_equal(ledger_ended_count(l), 0);
	assert_int_equal(ledger_read_row(l, 2, &j, &e), 0);
	assert_int_equal(ledger_read_row(l, 3, &j, &e), 1); /* the job is not over */
	struct ledger_job again = {.id = 3, .owner = "", .name = "", .version = "", .record = ""};
	assert_int_equal(ledger_add(l, &again, &e), -EEXIST); /* an id is given once */
	ledger_close(l);
}

/* Makes a database as the first version did, with one job in it. */
static void database_of_an_earlier_version_is_read(void **state)
{
	(void)state;
	struct ledger_job j;
	ledger_files_execute(
		"jobs.db",
		"CREATE TABLE jobs (id INTEGER PRIMARY KEY, owner TEXT NOT NULL, name TEXT NOT NULL, version TEXT NOT NULL,"
		" priority INTEGER NOT NULL, mixed INTEGER NOT NULL, state TEXT NOT NULL, submitted REAL NOT NULL,"
		" ended REAL, submission BLOB, plan BLOB) STRICT;"
		"CREATE INDEX living ON jobs (id) WHERE ended IS NULL;"
		"INSERT INTO jobs VALUES (7, 'ann', 'old', '0.1', 2, 0, 'live', 5.5, NULL, x'0001', x'02');"
		"PRAGMA user_version = 1");
	struct ledger *l = open_ledger();
	for (int again = 0; again < 2; again++) {
		assert_int_equal(next_live(l, 0, &j), 1);
		assert_true(j.id == 7 && j.priority == 2 && j.submitted == 5.5 && j.submission_size == 2 &&
			    j.plan_size == 1);
		assert_string_equal(j.owner, "ann");
		assert_string_equal(j.holder, again ? "bob" : "");
		assert_int_equal(ledger_set_holder(l, 7, "bob", &e), 0);
		ledger_close(l);
		l = open_ledger();
	}
	add_job(l, 8);
	ledger_close(l);
}

static void hold_and_priority_are_kept(void **state)
{
	(void)state;
	struct ledger_job j;
	struct ledger *l = open_ledger();
	add_job(l, 1);
	add_job(l, 2);
	assert_int_equal(next_live(l, 0, &j), 1);
	assert_string_equal(j.holder, "");
	assert_int_equal(ledger_set_holder(l, 1, "ann", &e), 0);
	assert_int_equal(ledger_set_priority(l, 2, 77, &e), 0);
	ledger_close(l);
	l = open_ledger();
	assert_int_equal(next_live(l, 0, &j), 1);
	assert_string_equal(j.holder, "ann");
	assert_int_equal(j.priority, -3);
	assert_int_equal(next_live(l, 1, &j), 1);
	assert_string_equal(j.holder, "");
	assert_int_equal(j.priority, 77);
	assert_int_equal(ledger_set_holder(l, 1, "", &e), 0);
	assert_int_equal(next_live(l, 0, &j), 1);
	assert_string_equal(j.holder, "");
	ledger_close(l);
}

/* An ended job is extended with another plan, whether or not its row recorded the end; a recorded end does not apply to
 * the extended job. */
static void ended_job_can_be_extended(void **state)
{
	(void)state;
	static const unsigned char longer[] = {7, 7, 7};
	struct ledger_job j,
		more = {.id = 1, .submission = longer, .submission_size = 3, .plan = longer, .plan_size = 2};
	struct ledger *l = open_ledger();
	add_job(l, 1);
	assert_int_equal(ledger_set_holder(l, 1, "ann", &e), 0);
	assert_int_equal(ledger_extend_job(l, &more, &e), 0);
	assert_int_equal(next_live(l, 0, &j), 1);
	assert_true(j.extended == 0 && j.submission_size == 3 && j.plan_size == 2);
	assert_int_equal(ledger_ended_count(l), 0);
	more.extended = 1; /* the job's end could not be written */
	assert_int_equal(ledger_extend_job(l, &more, &e), 0);
	assert_int_equal(ledger_end_job(l, make_record(1, 0, "done"), false, &e), 0);
	assert_int_equal(next_live(l, 0, &j), 1);
	assert_int_equal(j.extended, 1);
	assert_int_equal(ledger_end_job(l, make_record(1, 1, "done"), false, &e), 0);
	assert_int_equal(ledger_ended_count(l), 1);
	assert_int_equal(next_live(l, 0, &j), 0);
	assert_int_equal(ledger_read_row(l, 1, &j, &e), 1);
	assert_true(j.submission_size == 0 && j.priority == -3 && j.is_mixed);
	more.extended = 2;
	assert_int_equal(ledger_extend_job(l, &more, &e), 0);
	assert_int_equal(ledger_ended_count(l), 0);
	more.id = 2;
	assert_int_equal(ledger_extend_job(l, &more, &e), -ENOENT);
	ledger_close(l);
	l = open_ledger();
	assert_int_equal(next_live(l, 0, &j), 1);
	assert_true(j.id == 1 && j.extended == 2 && j.submission_size == 3 && j.plan_size == 2);
	assert_string_equal(j.owner, "7");
	assert_string_equal(j.holder, ""); /* cleared with the end of the job */
	assert_int_equal(ledger_read_row(l, 2, &j, &e), 0);
	ledger_close(l);
}

/* The checksum of a row whose numbers all differ is the one of the first build: a database written on one machine can
 * be read on any other. */
static void checksum_of_a_row_never_changes(void **state)
{
	(void)state;
	struct ledger *l = open_ledger();
	sqlite3 *db;
	sqlite3_stmt *row;
	add_job(l, 0x010203040506);
	assert_int_equal(ledger_set_priority(l, 0x010203040506, -7, &e), 0);
	ledger_close(l);
	assert_int_equal(sqlite3_open(ledger_files_path("jobs.db"), &db), SQLITE_OK);
	assert_int_equal(sqlite3_prepare_v2(db, "SELECT checksum, revision FROM jobs", -1, &row, NULL), SQLITE_OK);
	assert_int_equal(sqlite3_step(row), SQLITE_ROW);
	assert_int_equal(sqlite3_column_int64(row, 1), 1);
	assert_int_equal(sqlite3_column_int64(row, 0), 0x1833dd11);
	sqlite3_finalize(row);
	sqlite3_close(db);
}

static void set_version(const char *file, int32_t version)
{
	int fd = open(ledger_files_path(file), O_RDWR); /* user_version: bytes 60 to 63, big endian */
	uint32_t bytes = htonl((uint32_t)version);
	assert_int_equal(pwrite(fd, &bytes, sizeof bytes, 60), sizeof bytes);
	close(fd);
}

static void other_versions_are_refused(void **state)
{
	(void)state;
	static const char *const files[] = {"jobs.db", "jobs-copy.db"};
	struct ledger *l = open_ledger();
	add_job(l, 1);
	ledger_close(l);
	for (int i = 0; i < 2; i++) {
		set_version(files[i], 99);
		assert_int_equal(ledger_open(&l, temporary_folder, &e), -EPROTO);
		assert_non_null(strstr(e.text, "later"));
		set_version(files[i], 5);
	}
	l = open_ledger();
	ledger_close(l);
}

/* Ids are never given twice, even when no row remembers them. */
static void ids_are_never_given_twice(void **state)
{
	(void)state;
	struct ledger *l = open_ledger();
	assert_int_equal(ledger_next_id(l), 1);
	add_job(l, 1);
	add_job(l, 2);
	assert_int_equal(ledger_end_job(l, make_record(2, 0, "done"), false, &e), 0);
	assert_int_equal(ledger_delete_ended(l, (uint64_t[]){2}, 1, &e), 0);
	assert_int_equal(ledger_delete(l, 1, &e), 0);
	ledger_close(l);
	l = open_ledger();
	assert_int_equal(ledger_next_id(l), 3);
	assert_int_equal(ledger_skip_ids(l, 41, &e), 0);
	assert_int_equal(ledger_skip_ids(l, 7, &e), 0);
	ledger_close(l);
	l = open_ledger();
	assert_int_equal(ledger_next_id(l), 42);
	ledger_close(l);
}

/* A job's submission stays as long as its films, its record as long as its row. */
static void ended_job_keeps_its_submission_until_it_is_dropped(void **state)
{
	(void)state;
	struct ledger_job j;
	struct job_record r;
	struct ledger *l = open_ledger();
	add_job(l, 1);
	assert_int_equal(ledger_read_record(l, 1, &r, &e), -ENOENT);
	assert_int_equal(ledger_delete_submission(l, 1, &e), 0); /* the job is not over */
	assert_int_equal(ledger_end_job(l, make_record(1, 0, "failed"), true, &e), 0);
	assert_int_equal(ledger_read_row(l, 1, &j, &e), 1);
	assert_true(j.end_time > 1e9 && j.submission_size == 4 && j.plan_size == 2);
	assert_string_equal(j.state, "failed");
	ledger_close(l);
	l = open_ledger();
	assert_int_equal(ledger_read_record(l, 1, &r, &e), 0);
	assert_true(r.id == 1 && record_is_ended(&r) && r.cleared == 0);
	r.cleared = 7;
	assert_int_equal(ledger_write_record(l, &r, &e), 0);
	assert_int_equal(ledger_delete_submission(l, 1, &e), 0);
	assert_int_equal(ledger_read_row(l, 1, &j, &e), 1);
	assert_true(j.submission_size == 0 && j.plan_size == 0);
	assert_int_equal(ledger_read_record(l, 1, &r, &e), 0);
	assert_true(r.cleared == 7);
	r.id = 2;
	assert_int_equal(ledger_write_record(l, &r, &e), -ENOENT);
	text_copy(r.output, sizeof r.output, "caf\xe9");
	r.id = 1;
	assert_int_equal(ledger_write_record(l, &r, &e), -EINVAL);
	assert_non_null(strstr(e.text, "the record of job j1 cannot be written: Invalid UTF-8"));
	ledger_close(l);
}

static void notes_are_kept(void **state)
{
	(void)state;
	char *text;
	struct ledger *l = open_ledger();
	assert_int_equal(ledger_get_note(l, "clock", &text, &e), -ENOENT);
	for (int i = 0; i < 3; i++)
		assert_int_equal(ledger_set_note(l, "clock", i == 2 ? "1 'a'" : "0", &e), 0);
	ledger_close(l);
	l = open_ledger();
	assert_int_equal(ledger_get_note(l, "clock", &text, &e), 0);
	assert_string_equal(text, "1 'a'");
	mem_free(text);
	ledger_close(l);
}

/* Jobs come and go: of ended ones the file keeps only the records, and its WAL does not grow. */
static void file_stays_small_while_jobs_come_and_go(void **state)
{
	(void)state;
	struct stat st;
	struct ledger *l = open_ledger();
	unsigned char big[20000];
	memset(big, 1, sizeof big);
	for (uint64_t id = 1; id <= 300; id++) {
		struct ledger_job j = {.id = id,
				       .owner = "",
				       .name = "",
				       .version = "",
				       .record = "",
				       .submission = big,
				       .submission_size = sizeof big,
				       .plan = big,
				       .plan_size = 10};
		assert_int_equal(ledger_add(l, &j, &e), 0);
		assert_int_equal(ledger_end_job(l, make_record(id, 0, "done"), false, &e), 0);
	}
	assert_int_equal(stat(ledger_files_path("jobs.db-wal"), &st), 0);
	assert_true(st.st_size < 8 << 20);
	assert_int_equal(stat(ledger_files_path("jobs.db"), &st), 0);
	assert_true(st.st_size < 2 << 20); /* the submissions alone would be 6 MB */
	ledger_close(l);
}

/* Adds rows as large as those of real jobs; every third job is not over. */
static void add_rows(int rows)
{
	char sql[600];
	struct ledger *l = open_ledger(); /* creates the tables */
	ledger_close(l);
	snprintf(
		sql, sizeof sql,
		"WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < %d)"
		" INSERT INTO jobs (id, owner, name, version, priority, mixed, state, submitted, ended, record, checksum)"
		" SELECT i, '', '', '', 0, 0, 'done', 0, CASE WHEN i %% 3 THEN 1 END, printf('%%.3800c', 'x'), -1 FROM n",
		rows);
	ledger_files_execute("jobs.db", sql);
}

static void ended_jobs_are_listed_by_pages(void **state)
{
	(void)state;
	enum { ROWS = 4000, PAGE_SIZE = 7 };
	uint64_t found[PAGE_SIZE], id = 0, before, after, next = 1;
	size_t count;
	add_rows(ROWS);
	struct ledger *l = open_ledger();
	if (!bytes_read_count(&before)) {
		ledger_close(l);
		skip();
	}
	for (int page = 0; page < 3; page++) {
		assert_int_equal(ledger_list_ended(l, LEDGER_ABOVE, id, found, PAGE_SIZE, &count, &e), 0);
		assert_int_equal(count, PAGE_SIZE);
		for (size_t i = 0; i < count; i++, next++) {
			next += next % 3 == 0;
			assert_int_equal(found[i], next);
		}
		id = found[count - 1];
	}
	assert_int_equal(ledger_list_ended(l, LEDGER_BELOW, UINT64_MAX, found, PAGE_SIZE, &count, &e), 0);
	assert_true(count == PAGE_SIZE && found[0] == ROWS && found[1] == ROWS - 2 && found[2] == ROWS - 3);
	assert_int_equal(ledger_list_ended(l, LEDGER_BELOW, 5, found, PAGE_SIZE, &count, &e), 0);
	assert_true(count == 3 && found[0] == 4 && found[1] == 2 && found[2] == 1);
	assert_int_equal(ledger_list_ended(l, LEDGER_BELOW, 1, found, PAGE_SIZE, &count, &e), 0);
	assert_int_equal(count, 0);
	assert_int_equal(ledger_list_ended(l, LEDGER_ABOVE, ROWS, found, PAGE_SIZE, &count, &e), 0);
	assert_int_equal(count, 0);
	assert_true(bytes_read_count(&after));
	print_message("   %d KB read of %d\n", (int)((after - before) >> 10), ROWS * 4);
	assert_true(after - before < 2 << 20); /* the table has 16 MB */
	ledger_close(l);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(ended_jobs_are_listed_by_pages, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(live_jobs_survive_reopening, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(lack_of_memory_writes_no_row, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(database_of_an_earlier_version_is_read, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(ended_job_can_be_extended, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(hold_and_priority_are_kept, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(ended_job_keeps_its_submission_until_it_is_dropped,
						temporary_folder_set_up, temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(ids_are_never_given_twice, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(notes_are_kept, temporary_folder_set_up, temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(checksum_of_a_row_never_changes, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(other_versions_are_refused, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(file_stays_small_while_jobs_come_and_go, temporary_folder_set_up,
						temporary_folder_tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
