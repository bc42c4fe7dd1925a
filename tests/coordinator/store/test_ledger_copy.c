/* SPDX-License-Identifier: Apache-2.0 */
/* What one of the two files of the ledger has lost is restored from the other; what both have lost is not made up. */
#include "coordinator/store/ledger.h"

#include "common/base/log.h"
#include "common/base/mem.h"
#include "common/base/text.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/ledger_files.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <fcntl.h>
#include <sqlite3.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { ROWS = 5 };
static const char *const files[] = {"jobs.db", "jobs-copy.db"};
static struct error e;

static struct ledger *open_ledger(void)
{
	struct ledger *l;
	assert_int_equal(ledger_open(&l, temporary_folder, &e), 0);
	return l;
}

static void fill_ledger(void)
{
	struct ledger *l = open_ledger();
	struct job_record r;
	for (uint64_t id = 1; id <= ROWS; id++) {
		struct ledger_job j = {.id = id,
				       .owner = "ann",
				       .name = "box",
				       .version = "1",
				       .record = "",
				       .submission = (const unsigned char *)"submission",
				       .submission_size = 10,
				       .plan = (const unsigned char *)"plan",
				       .plan_size = 4};
		assert_int_equal(ledger_add(l, &j, &e), 0);
	}
	record_init(&r, ROWS, "box", "ann");
	text_copy(r.state, sizeof r.state, "done");
	assert_int_equal(ledger_end_job(l, &r, false, &e), 0);
	assert_int_equal(ledger_set_priority(l, 2, 7, &e), 0);
	assert_int_equal(ledger_set_note(l, "clock", "later", &e), 0);
	ledger_close(l);
}

/* Checks twice: what was restored is there the next time, too. */
static void assert_filled(void)
{
	for (int again = 0; again < 2; again++) {
		struct ledger *l = open_ledger();
		struct job_record r;
		struct ledger_job j;
		char *text;
		for (uint64_t id = 1; id <= ROWS; id++) {
			assert_int_equal(ledger_read_row(l, id, &j, &e), 1);
			assert_true(!j.is_damaged && j.priority == (id == 2 ? 7 : 0));
			assert_string_equal(j.state, id == ROWS ? "done" : "live");
			assert_int_equal(j.submission_size, id == ROWS ? 0 : 10);
		}
		assert_int_equal(ledger_read_record(l, ROWS, &r, &e), 0);
		assert_int_equal(ledger_get_note(l, "clock", &text, &e), 0);
		assert_string_equal(text, "later");
		mem_free(text);
		assert_int_equal(ledger_next_id(l), ROWS + 1);
		ledger_close(l);
	}
}

static void overwrite_with_text(const char *file)
{
	int fd = open(ledger_files_path(file), O_RDWR | O_TRUNC);
	static const char text[] = "This is no database, but a text that is long enough to be looked at as one, if any"
				   "body looked; and so on.";
	assert_int_equal(write(fd, text, sizeof text), sizeof text);
	close(fd);
}

static void lost_file_is_restored(void **state)
{
	(void)state;
	fill_ledger();
	for (int i = 0; i < 2; i++) {
		assert_int_equal(unlink(ledger_files_path(files[i])), 0);
		assert_filled();
	}
}

static void file_that_is_no_database_is_replaced(void **state)
{
	(void)state;
	fill_ledger();
	for (int i = 0; i < 2; i++) {
		char damaged[40];
		overwrite_with_text(files[i]);
		assert_filled();
		snprintf(damaged, sizeof damaged, "%s.damaged", files[i]);
		assert_int_equal(access(ledger_files_path(damaged), F_OK), 0);
	}
}

static void lost_or_changed_rows_are_restored(void **state)
{
	(void)state;
	static const char *const statements[] = {
		"DELETE FROM jobs",
		"DELETE FROM notes",
		"UPDATE notes SET text = replace(text, 'later', 'latex')",
		"UPDATE notes SET text = replace(text, 'crc32c', 'crc32d'), revision = revision + 9",
		"UPDATE notes SET text = replace(text, 'later', 'never'), revision = revision + 9",
		"UPDATE jobs SET priority = 3",
		"UPDATE jobs SET record = '{}'",
		"UPDATE jobs SET ended = 5, state = 'done', submission = NULL, plan = NULL WHERE ended IS NULL",
		"UPDATE jobs SET plan = CAST('plaN' AS BLOB) WHERE id = 3",
		"UPDATE jobs SET checksum = NULL",
		"DROP TABLE notes; CREATE TABLE notes (name TEXT PRIMARY KEY, text TEXT NOT NULL, revision INTEGER NOT NULL)",
	};
	fill_ledger();
	for (size_t s = 0; s < sizeof statements / sizeof *statements; s++)
		for (int i = 0; i < 2; i++) {
			ledger_files_execute(files[i], statements[s]);
			assert_filled();
		}
}

/* jobs.db is replaced by a backup from before a change. */
static void older_file_is_brought_up_to_date(void **state)
{
	(void)state;
	char command[500];
	struct ledger *l = open_ledger();
	struct ledger_job j = {.id = 1, .owner = "", .name = "", .version = "", .record = ""};
	assert_int_equal(ledger_add(l, &j, &e), 0);
	ledger_close(l);
	for (int i = 0; i < 2; i++) {
		snprintf(command, sizeof command, "cp '%s/%s' '%s/old'", temporary_folder, files[i], temporary_folder);
		assert_int_equal(system(command), 0);
		l = open_ledger();
		assert_int_equal(ledger_set_priority(l, 1, 10 + i, &e), 0);
		assert_int_equal(ledger_set_note(l, "clock", i ? "2" : "1", &e), 0);
		ledger_close(l);
		snprintf(command, sizeof command, "mv '%s/old' '%s/%s'", temporary_folder, temporary_folder, files[i]);
		assert_int_equal(system(command), 0);
		l = open_ledger();
		char *text;
		assert_int_equal(ledger_read_row(l, 1, &j, &e), 1);
		assert_int_equal(j.priority, 10 + i);
		assert_int_equal(ledger_get_note(l, "clock", &text, &e), 0);
		assert_string_equal(text, i ? "2" : "1");
		mem_free(text);
		ledger_close(l);
	}
}

static void row_damaged_in_both_files_is_reported(void **state)
{
	(void)state;
	struct ledger_job j;
	struct job_record r;
	char *text;
	fill_ledger();
	for (int i = 0; i < 2; i++)
		ledger_files_execute(files[i], "UPDATE jobs SET priority = 3 WHERE id IN (1, 5);"
					       "UPDATE notes SET text = replace(text, 'later', 'never')");
	struct ledger *l = open_ledger();
	assert_int_equal(ledger_read_row(l, 1, &j, &e), 1);
	assert_true(j.is_damaged && j.id == 1);
	assert_int_equal(ledger_get_note(l, "clock", &text, &e), -EBADMSG);
	assert_int_equal(ledger_set_note(l, "clock", "again", &e), 0);
	assert_int_equal(ledger_get_note(l, "clock", &text, &e), 0);
	assert_string_equal(text, "again");
	mem_free(text);
	assert_int_equal(ledger_set_holder(l, 1, "bob", &e), -EBADMSG);
	assert_non_null(strstr(e.text, "the row of j1 is damaged"));
	assert_int_equal(ledger_read_record(l, 5, &r, &e), -EBADMSG);
	assert_int_equal(ledger_read_row(l, 2, &j, &e), 1);
	assert_false(j.is_damaged);
	assert_int_equal(ledger_delete(l, 1, &e), 0);
	assert_int_equal(ledger_read_row(l, 1, &j, &e), 0);
	ledger_close(l);
	for (int i = 0; i < 2; i++)
		overwrite_with_text(files[i]);
	l = open_ledger();
	assert_int_equal(ledger_next_id(l), 1);
	ledger_close(l);
}

/* Notes of spools from before notes had checksums. The highest job id replaces the missing number of the next job. */
static void notes_without_checksums_are_read(void **state)
{
	(void)state;
	char *text;
	fill_ledger();
	for (int i = 0; i < 2; i++)
		ledger_files_execute(files[i],
				     "UPDATE notes SET text = 'earlier';"
				     "INSERT OR REPLACE INTO notes VALUES ('next-job', '77\ncrc32c=00000000', 1)");
	struct ledger *l = open_ledger();
	assert_int_equal(ledger_get_note(l, "clock", &text, &e), 0);
	assert_string_equal(text, "earlier");
	mem_free(text);
	assert_int_equal(ledger_next_id(l), ROWS + 1);
	ledger_close(l);
}

/* ---- a copy that cannot be written ---- */

static _Atomic bool refuses_copy_writes;
static sqlite3 *connection; /* the ledger's own connection */

static int record_connection(sqlite3 *db, const char **text, const struct sqlite3_api_routines *api)
{
	(void)text;
	(void)api;
	connection = db;
	return SQLITE_OK;
}

/* Called before each write to a table; refuses those to the copy. */
static int deny_writes_to_copy(void *user, int what, const char *a, const char *b, const char *file,
			       const char *trigger)
{
	(void)user;
	(void)a;
	(void)b;
	(void)trigger;
	bool writes = what == SQLITE_INSERT || what == SQLITE_UPDATE || what == SQLITE_DELETE;
	return refuses_copy_writes && writes && file && strcmp(file, "copy") == 0 ? SQLITE_DENY : SQLITE_OK;
}

/* Rows written meanwhile are in jobs.db, and also in the copy once that can be written. */
static void copy_that_fell_behind_is_mended(void **state)
{
	(void)state;
	struct ledger_job j;
	fill_ledger();
	sqlite3_auto_extension((void (*)(void))record_connection);
	struct ledger *l = open_ledger();
	sqlite3_reset_auto_extension();
	/* Setting an authorizer makes SQLite compile statements again. */
	assert_int_equal(sqlite3_set_authorizer(connection, deny_writes_to_copy, NULL), SQLITE_OK);
	refuses_copy_writes = true;
	assert_int_equal(ledger_set_priority(l, 3, 9, &e), 0);
	assert_int_equal(ledger_set_note(l, "clock", "latest", &e), 0);
	assert_true(ledger_repair_copy(l, &e) < 0);
	assert_true(ledger_delete_ended(l, (uint64_t[]){ROWS}, 1, &e) < 0);
	refuses_copy_writes = false;
	assert_int_equal(ledger_repair_copy(l, &e), 0);
	assert_int_equal(ledger_delete_ended(l, (uint64_t[]){ROWS}, 1, &e), 0);
	ledger_close(l);
	assert_int_equal(unlink(ledger_files_path("jobs.db")), 0);
	l = open_ledger();
	char *text;
	assert_int_equal(ledger_read_row(l, 3, &j, &e), 1);
	assert_int_equal(j.priority, 9);
	assert_int_equal(ledger_read_row(l, ROWS, &j, &e), 0);
	assert_int_equal(ledger_get_note(l, "clock", &text, &e), 0);
	assert_string_equal(text, "latest");
	mem_free(text);
	ledger_close(l);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(lost_file_is_restored, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(file_that_is_no_database_is_replaced, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(lost_or_changed_rows_are_restored, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(older_file_is_brought_up_to_date, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(row_damaged_in_both_files_is_reported, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(notes_without_checksums_are_read, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(copy_that_fell_behind_is_mended, temporary_folder_set_up,
						temporary_folder_tear_down),
	};
	log_set_level(LOG_LEVEL_ERROR);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
