/* SPDX-License-Identifier: Apache-2.0 */
/* The database of jobs: what was added is there again, what has ended is not, another version is refused. */
#include "coordinator/store/ledger.h"
#include "tests/support/folder.h"

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

static struct ledger *open_ledger(char path[128])
{
	struct ledger *l;
	struct error e;
	snprintf(path, 128, "%s/jobs.db", folder);
	assert_int_equal(ledger_open(&l, path, &e), 0);
	return l;
}

static void add(struct ledger *l, uint64_t id)
{
	static const unsigned char submission[] = {0, 1, 0, 255}, plan[] = {9, 0};
	struct error e;
	struct ledger_job j = {.id = id,
			       .owner = "7",
			       .name = "a 'name'",
			       .version = "0.1",
			       .priority = -3,
			       .mixed = true,
			       .submitted = 12.5,
			       .submission = submission,
			       .submission_size = sizeof submission,
			       .plan = plan,
			       .plan_size = sizeof plan};
	assert_int_equal(ledger_add(l, &j, &e), 0);
}

static void living_jobs(void **state)
{
	(void)state;
	char path[128];
	struct error e;
	struct ledger_job j;
	struct ledger *l = open_ledger(path);
	assert_int_equal(ledger_next(l, 0, &j, &e), 0);
	for (uint64_t id = 1; id <= 3; id++)
		add(l, id);
	assert_int_equal(ledger_end(l, 2, 0, "done", &e), 0);
	ledger_close(l);
	l = open_ledger(path);
	assert_int_equal(ledger_next(l, 0, &j, &e), 1);
	assert_int_equal(j.id, 1);
	assert_string_equal(j.owner, "7");
	assert_string_equal(j.name, "a 'name'");
	assert_string_equal(j.version, "0.1");
	assert_int_equal(j.priority, -3);
	assert_true(j.mixed && j.submitted == 12.5);
	assert_int_equal(j.submission_size, 4);
	assert_memory_equal(j.submission, "\0\1\0\377", 4);
	assert_int_equal(j.plan_size, 2);
	assert_memory_equal(j.plan, "\11\0", 2);
	assert_int_equal(ledger_next(l, 1, &j, &e), 1);
	assert_int_equal(j.id, 3);
	assert_int_equal(ledger_next(l, 3, &j, &e), 0);
	assert_int_equal(ledger_drop(l, (const uint64_t[]){7, 3}, 2, &e), 0);
	assert_int_equal(ledger_get(l, 2, &j, &e), 1);
	assert_int_equal(ledger_drop(l, (const uint64_t[]){2, 3}, 2, &e), 0);
	assert_int_equal(ledger_get(l, 2, &j, &e), 0);
	assert_int_equal(ledger_get(l, 3, &j, &e), 1); /* it lives */
	struct ledger_job again = {.id = 3, .owner = "", .name = "", .version = ""};
	assert_true(ledger_add(l, &again, &e) < 0); /* an id is given once */
	ledger_close(l);
}

/* As the first version made it, with a job in it. */
static void earlier_versions(void **state)
{
	(void)state;
	char path[128];
	sqlite3 *db;
	struct error e;
	struct ledger_job j;
	snprintf(path, sizeof path, "%s/jobs.db", folder);
	assert_int_equal(sqlite3_open(path, &db), SQLITE_OK);
	assert_int_equal(
		sqlite3_exec(
			db,
			"CREATE TABLE jobs (id INTEGER PRIMARY KEY, owner TEXT NOT NULL, name TEXT NOT NULL, version TEXT NOT NULL,"
			" priority INTEGER NOT NULL, mixed INTEGER NOT NULL, state TEXT NOT NULL, submitted REAL NOT NULL,"
			" ended REAL, submission BLOB, plan BLOB) STRICT;"
			"CREATE INDEX living ON jobs (id) WHERE ended IS NULL;"
			"INSERT INTO jobs VALUES (7, 'ann', 'old', '0.1', 2, 0, 'live', 5.5, NULL, x'0001', x'02');"
			"PRAGMA user_version = 1",
			NULL, NULL, NULL),
		SQLITE_OK);
	assert_int_equal(sqlite3_close(db), SQLITE_OK);
	struct ledger *l = open_ledger(path);
	for (int again = 0; again < 2; again++) {
		assert_int_equal(ledger_next(l, 0, &j, &e), 1);
		assert_true(j.id == 7 && j.priority == 2 && j.submitted == 5.5 && j.submission_size == 2 &&
			    j.plan_size == 1);
		assert_string_equal(j.owner, "ann");
		assert_string_equal(j.held, again ? "bob" : "");
		assert_int_equal(ledger_hold(l, 7, "bob", &e), 0);
		ledger_close(l);
		l = open_ledger(path);
	}
	add(l, 8);
	ledger_close(l);
}

static void orders(void **state)
{
	(void)state;
	char path[128];
	struct error e;
	struct ledger_job j;
	struct ledger *l = open_ledger(path);
	add(l, 1);
	add(l, 2);
	assert_int_equal(ledger_next(l, 0, &j, &e), 1);
	assert_string_equal(j.held, "");
	assert_int_equal(ledger_hold(l, 1, "ann", &e), 0);
	assert_int_equal(ledger_priority(l, 2, 77, &e), 0);
	ledger_close(l);
	l = open_ledger(path);
	assert_int_equal(ledger_next(l, 0, &j, &e), 1);
	assert_string_equal(j.held, "ann");
	assert_int_equal(j.priority, -3);
	assert_int_equal(ledger_next(l, 1, &j, &e), 1);
	assert_string_equal(j.held, "");
	assert_int_equal(j.priority, 77);
	assert_int_equal(ledger_hold(l, 1, "", &e), 0);
	assert_int_equal(ledger_next(l, 0, &j, &e), 1);
	assert_string_equal(j.held, "");
	ledger_close(l);
}

/* A job that ended lives again with another plan, whether the row knew of its end or not; and that end is not one of
 * its next life. */
static void extended(void **state)
{
	(void)state;
	static const unsigned char longer[] = {7, 7, 7};
	char path[128];
	struct error e;
	struct ledger_job j,
		more = {.id = 1, .submission = longer, .submission_size = 3, .plan = longer, .plan_size = 2};
	struct ledger *l = open_ledger(path);
	add(l, 1);
	assert_int_equal(ledger_hold(l, 1, "ann", &e), 0);
	assert_int_equal(ledger_extend(l, &more, &e), 0);
	assert_int_equal(ledger_next(l, 0, &j, &e), 1);
	assert_true(j.extended == 0 && j.submission_size == 3 && j.plan_size == 2);
	more.extended = 1; /* its end could not be written */
	assert_int_equal(ledger_extend(l, &more, &e), 0);
	assert_int_equal(ledger_end(l, 1, 0, "done", &e), 0);
	assert_int_equal(ledger_next(l, 0, &j, &e), 1);
	assert_int_equal(j.extended, 1);
	assert_int_equal(ledger_end(l, 1, 1, "done", &e), 0);
	assert_int_equal(ledger_next(l, 0, &j, &e), 0);
	assert_int_equal(ledger_get(l, 1, &j, &e), 1);
	assert_true(j.submission_size == 0 && j.priority == -3 && j.mixed);
	more.extended = 2;
	assert_int_equal(ledger_extend(l, &more, &e), 0);
	more.id = 2;
	assert_int_equal(ledger_extend(l, &more, &e), -ENOENT);
	ledger_close(l);
	l = open_ledger(path);
	assert_int_equal(ledger_next(l, 0, &j, &e), 1);
	assert_true(j.id == 1 && j.extended == 2 && j.submission_size == 3 && j.plan_size == 2);
	assert_string_equal(j.owner, "7");
	assert_string_equal(j.held, ""); /* with the end of the job that is over, too */
	assert_int_equal(ledger_get(l, 2, &j, &e), 0);
	ledger_close(l);
}

static void set_version(const char *path, int32_t version)
{
	int fd = open(path, O_RDWR); /* user_version: bytes 60 to 63, big endian */
	uint32_t bytes = htonl((uint32_t)version);
	assert_int_equal(pwrite(fd, &bytes, sizeof bytes, 60), sizeof bytes);
	close(fd);
}

static void versions(void **state)
{
	(void)state;
	char path[128];
	struct error e;
	struct ledger *l = open_ledger(path);
	add(l, 1);
	ledger_close(l);
	set_version(path, 99);
	assert_int_equal(ledger_open(&l, path, &e), -EPROTO);
	assert_non_null(strstr(e.text, "later"));
	set_version(path, -1140850685);
	assert_int_equal(ledger_open(&l, path, &e), -EBADMSG);
	assert_non_null(strstr(e.text, "damaged"));
	set_version(path, 4);
	l = open_ledger(path);
	ledger_close(l);
	int fd = open(path, O_RDWR | O_TRUNC);
	assert_int_equal(
		write(fd,
		      "this is no database, but a text that is long enough to be looked at as one, if anybody looked; and so on",
		      100),
		100);
	close(fd);
	assert_int_equal(ledger_open(&l, path, &e), -EBADMSG);
}

/* Jobs come and go: neither the file nor its WAL grow with them. */
static void stays_small(void **state)
{
	(void)state;
	char path[128], wal[160];
	struct error e;
	struct stat st;
	struct ledger *l = open_ledger(path);
	unsigned char big[20000];
	memset(big, 1, sizeof big);
	for (uint64_t id = 1; id <= 300; id++) {
		struct ledger_job j = {.id = id,
				       .owner = "",
				       .name = "",
				       .version = "",
				       .submission = big,
				       .submission_size = sizeof big,
				       .plan = big,
				       .plan_size = 10};
		assert_int_equal(ledger_add(l, &j, &e), 0);
		assert_int_equal(ledger_end(l, id, 0, "done", &e), 0);
	}
	snprintf(wal, sizeof wal, "%s-wal", path);
	assert_int_equal(stat(wal, &st), 0);
	assert_true(st.st_size < 8 << 20);
	assert_int_equal(stat(path, &st), 0);
	assert_true(st.st_size < 1 << 18);
	ledger_close(l);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(living_jobs, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(earlier_versions, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(extended, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(orders, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(versions, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(stays_small, folder_set_up, folder_tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
