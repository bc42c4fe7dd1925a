/* SPDX-License-Identifier: Apache-2.0 */
/* Films of finished jobs: those of the oldest jobs are deleted when there are too many, all of them when a running job
 * needs the room; results stay. */
#include "common/base/disk.h"
#include "common/base/mem.h"
#include "coordinator/retention/keep.h"
#include "tests/support/failing_list.h"
#include "tests/support/folder.h"

#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

static struct jobs jobs;
static struct job_record ended[3];

static void write_file(uint64_t job, const char *file, off_t size)
{
	char path[SPOOL_PATH_MAX];
	spool_job_path(jobs.spool, job, file, path);
	int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0600);
	assert_true(fd >= 0);
	assert_int_equal(ftruncate(fd, size), 0);
	close(fd);
}

static bool is_there(uint64_t job, const char *file)
{
	char path[SPOOL_PATH_MAX];
	spool_job_path(jobs.spool, job, file, path);
	return access(path, F_OK) == 0;
}

/* Three jobs of 1,000 bytes each, in the order in which they ended: j3, j1, j2. */
static void fill(void)
{
	static const uint64_t ids[] = {3, 1, 2};
	for (size_t i = 0; i < 3; i++) {
		ended[i] = (struct job_record){.id = ids[i]};
		write_file(ids[i], "checkpoint", 500);
		write_file(ids[i], "journal.2", 500);
		write_file(ids[i], "result.exr", 9000);
	}
	jobs.ended = ended;
	jobs.ended_count = 3;
}

static void add(uint64_t id)
{
	struct error e;
	struct job_record r;
	struct ledger_job j = {.id = id,
			       .owner = "",
			       .name = "",
			       .version = "",
			       .record = "",
			       .submission = (const unsigned char *)"s",
			       .submission_size = 1};
	record_begin(&r, id, "", "");
	assert_int_equal(spool_make_job(jobs.spool, id, &e), 0);
	assert_int_equal(ledger_add(jobs.ledger, &j, &e), 0);
	assert_int_equal(ledger_end(jobs.ledger, &r, true, &e), 0);
}

/* Returns whether the job can be extended. */
static bool has_submission(uint64_t id)
{
	struct error e;
	struct ledger_job j;
	assert_int_equal(ledger_get(jobs.ledger, id, &j, &e), 1);
	return j.submission_size > 0;
}

static void the_first_go_first(void **state)
{
	(void)state;
	struct error e;
	char path[128];
	snprintf(path, sizeof path, "%s/spool", folder);
	assert_int_equal(spool_open(&jobs.spool, path, &e), 0);
	assert_int_equal(ledger_open(&jobs.ledger, path, &e), 0);
	for (uint64_t id = 1; id <= 3; id++)
		add(id);
	fill();
	jobs.config.keep_bytes = 3000;
	keep_trim(&jobs);
	assert_true(is_there(3, "checkpoint") && is_there(1, "checkpoint") && is_there(2, "journal.2"));
	jobs.config.keep_bytes = 2999;
	keep_trim(&jobs);
	assert_false(is_there(3, "checkpoint") || is_there(3, "journal.2"));
	assert_true(is_there(1, "journal.2") && is_there(2, "checkpoint"));
	assert_true(!has_submission(3) && has_submission(1));
	assert_true(keep_drop_all(&jobs));
	assert_false(is_there(1, "journal.2") || is_there(2, "checkpoint"));
	assert_false(keep_drop_all(&jobs)); /* there is nothing more to delete */
	for (uint64_t id = 1; id <= 3; id++)
		assert_true(is_there(id, "result.exr"));
	ledger_close(jobs.ledger);
	spool_close(jobs.spool);
}

static void end_at(uint64_t id, double seconds)
{
	struct error e;
	struct ledger_job j;
	add(id);
	assert_int_equal(ledger_get(jobs.ledger, id, &j, &e), 1);
	char *record = mem_strdup(j.record);
	j.owner = j.name = j.version = j.held = "";
	j.state = "done";
	j.record = record;
	j.submission_size = j.plan_size = 0;
	j.ended = seconds;
	assert_int_equal(ledger_put(jobs.ledger, &j, &e), 0);
	mem_free(record);
}

/* After a start the coordinator knows the jobs that ended last, as the run before it did, however old they are; a long
 * job is among them. Films of jobs that it did not know would not be counted. */
static void the_last_are_known_after_a_start(void **state)
{
	(void)state;
	struct error e;
	char path[128];
	jobs = (struct jobs){0};
	snprintf(path, sizeof path, "%s/later", folder);
	assert_int_equal(spool_open(&jobs.spool, path, &e), 0);
	assert_int_equal(ledger_open(&jobs.ledger, path, &e), 0);
	for (uint64_t id = 2; id <= ENDED_MAX + 1; id++)
		end_at(id, 100.0 + (double)id);
	end_at(1, 1000);
	jobs.config.spool = path;
	assert_int_equal(ended_jobs_open(&jobs, &e), 0);
	assert_int_equal(jobs.ended_count, ENDED_MAX);
	assert_int_equal(jobs.ended[ENDED_MAX - 1].id, 1);
	for (size_t i = 0; i < ENDED_MAX - 1; i++)
		assert_int_equal(jobs.ended[i].id, i + 3);
	mem_free(jobs.ended);
	/* Jobs that ended while the clock was wrong do not count as later than those that follow. */
	end_at(ENDED_MAX + 4, 4e9);
	ledger_close(jobs.ledger);
	assert_int_equal(ledger_open(&jobs.ledger, path, &e), 0);
	add(ENDED_MAX + 3);
	add(ENDED_MAX + 2);
	jobs.ended_count = 0;
	add(ENDED_MAX + 5);
	assert_int_equal(ended_jobs_open(&jobs, &e), 0);
	static const uint64_t last[] = {ENDED_MAX + 4, ENDED_MAX + 3, ENDED_MAX + 2, ENDED_MAX + 5};
	for (size_t i = 0; i < 4; i++)
		assert_int_equal(jobs.ended[ENDED_MAX - 4 + i].id, last[i]);
	mem_free(jobs.ended);
	ledger_close(jobs.ledger);
	spool_close(jobs.spool);
}

static int no_unlink(const char *path)
{
	(void)path;
	errno = EIO;
	return -1;
}

/* A caller that needs room asks until there is none left to free: films that cannot be deleted now, because an
 * extension reads them or the disk fails, must not be reported as deleted, or the coordinator would ask for ever. */
static void what_cannot_go_makes_no_room(void **state)
{
	(void)state;
	struct error e;
	char path[128];
	snprintf(path, sizeof path, "%s/spool", folder);
	jobs = (struct jobs){0};
	assert_int_equal(spool_open(&jobs.spool, path, &e), 0);
	assert_int_equal(ledger_open(&jobs.ledger, path, &e), 0);
	for (uint64_t id = 1; id <= 3; id++)
		add(id);
	fill();
	struct disk own = disk_system;
	own.unlink = no_unlink;
	disk_use(&own);
	assert_false(keep_drop_all(&jobs));
	disk_use(NULL);
	failing_list_begin("/jobs/j", 1, EIO);
	keep_trim(&jobs); /* the size of no job's films is known */
	assert_false(keep_drop_all(&jobs));
	failing_list_end();
	for (uint64_t id = 1; id <= 3; id++)
		assert_true(is_there(id, "checkpoint") && is_there(id, "journal.2"));
	jobs.reading = &(struct live_job){.id = 1};
	assert_true(keep_drop_all(&jobs));
	assert_false(keep_drop_all(&jobs));
	assert_true(is_there(1, "checkpoint") && !is_there(2, "checkpoint") && !is_there(3, "journal.2"));
	ledger_close(jobs.ledger);
	spool_close(jobs.spool);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(the_first_go_first, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(the_last_are_known_after_a_start, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(what_cannot_go_makes_no_room, folder_set_up, folder_tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
