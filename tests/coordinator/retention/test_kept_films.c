/* SPDX-License-Identifier: Apache-2.0 */
/* Films of finished jobs: those of the oldest jobs are deleted when there are too many, all of them when a running job
 * needs the room; results stay. */
#include "common/base/disk.h"
#include "common/base/mem.h"
#include "coordinator/retention/kept_films.h"
#include "tests/support/failing_list.h"
#include "tests/support/temporary_folder.h"

#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

static struct jobs jobs;
static struct job_record ended_records[3];

static void write_file(uint64_t job, const char *file, off_t size)
{
	char path[SPOOL_PATH_MAX];
	spool_job_path(jobs.spool, job, file, path);
	int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0600);
	assert_true(fd >= 0);
	assert_int_equal(ftruncate(fd, size), 0);
	close(fd);
}

static bool job_file_exists(uint64_t job, const char *file)
{
	char path[SPOOL_PATH_MAX];
	spool_job_path(jobs.spool, job, file, path);
	return access(path, F_OK) == 0;
}

/* Three jobs of 1,000 bytes each, in the order in which they ended: j3, j1, j2. */
static void make_films(void)
{
	static const uint64_t ids[] = {3, 1, 2};
	for (size_t i = 0; i < 3; i++) {
		ended_records[i] = (struct job_record){.id = ids[i]};
		write_file(ids[i], "checkpoint", 500);
		write_file(ids[i], "journal.2", 500);
		write_file(ids[i], "result.exr", 9000);
	}
	jobs.ended_jobs = ended_records;
	jobs.ended_job_count = 3;
}

static void add_ended_job(uint64_t id)
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
	record_init(&r, id, "", "");
	assert_int_equal(spool_create_job_folder(jobs.spool, id, &e), 0);
	assert_int_equal(ledger_add(jobs.ledger, &j, &e), 0);
	assert_int_equal(ledger_end_job(jobs.ledger, &r, true, &e), 0);
}

/* Returns whether the job can be extended. */
static bool has_submission(uint64_t id)
{
	struct error e;
	struct ledger_job j;
	assert_int_equal(ledger_read_row(jobs.ledger, id, &j, &e), 1);
	return j.submission_size > 0;
}

static void films_of_the_oldest_jobs_are_deleted_first(void **state)
{
	(void)state;
	struct error e;
	char path[128];
	snprintf(path, sizeof path, "%s/spool", temporary_folder);
	assert_int_equal(spool_open(&jobs.spool, path, &e), 0);
	assert_int_equal(ledger_open(&jobs.ledger, path, &e), 0);
	for (uint64_t id = 1; id <= 3; id++)
		add_ended_job(id);
	make_films();
	jobs.config.retained_film_bytes = 3000;
	kept_films_trim(&jobs);
	assert_true(job_file_exists(3, "checkpoint") && job_file_exists(1, "checkpoint") &&
		    job_file_exists(2, "journal.2"));
	jobs.config.retained_film_bytes = 2999;
	kept_films_trim(&jobs);
	assert_false(job_file_exists(3, "checkpoint") || job_file_exists(3, "journal.2"));
	assert_true(job_file_exists(1, "journal.2") && job_file_exists(2, "checkpoint"));
	assert_true(!has_submission(3) && has_submission(1));
	assert_true(kept_films_drop_all(&jobs));
	assert_false(job_file_exists(1, "journal.2") || job_file_exists(2, "checkpoint"));
	assert_false(kept_films_drop_all(&jobs)); /* there is nothing more to delete */
	for (uint64_t id = 1; id <= 3; id++)
		assert_true(job_file_exists(id, "result.exr"));
	ledger_close(jobs.ledger);
	spool_close(jobs.spool);
}

static void add_job_ended_at(uint64_t id, double seconds)
{
	struct error e;
	struct ledger_job j;
	add_ended_job(id);
	assert_int_equal(ledger_read_row(jobs.ledger, id, &j, &e), 1);
	char *record = mem_strdup(j.record);
	j.owner = j.name = j.version = j.holder = "";
	j.state = "done";
	j.record = record;
	j.submission_size = j.plan_size = 0;
	j.end_time = seconds;
	assert_int_equal(ledger_write_row(jobs.ledger, &j, &e), 0);
	mem_free(record);
}

/* After a start the coordinator knows the jobs that ended last, as the run before it did, however old they are; a long
 * job is among them. Films of jobs that it did not know would not be counted. */
static void latest_ended_jobs_are_known_after_a_start(void **state)
{
	(void)state;
	struct error e;
	char path[128];
	jobs = (struct jobs){0};
	snprintf(path, sizeof path, "%s/later", temporary_folder);
	assert_int_equal(spool_open(&jobs.spool, path, &e), 0);
	assert_int_equal(ledger_open(&jobs.ledger, path, &e), 0);
	for (uint64_t id = 2; id <= ENDED_JOBS_MAX + 1; id++)
		add_job_ended_at(id, 100.0 + (double)id);
	add_job_ended_at(1, 1000);
	jobs.config.spool_folder = path;
	assert_int_equal(ended_jobs_open(&jobs, &e), 0);
	assert_int_equal(jobs.ended_job_count, ENDED_JOBS_MAX);
	assert_int_equal(jobs.ended_jobs[ENDED_JOBS_MAX - 1].id, 1);
	for (size_t i = 0; i < ENDED_JOBS_MAX - 1; i++)
		assert_int_equal(jobs.ended_jobs[i].id, i + 3);
	mem_free(jobs.ended_jobs);
	/* Jobs that ended while the clock was wrong do not count as later than those that follow. */
	add_job_ended_at(ENDED_JOBS_MAX + 4, 4e9);
	ledger_close(jobs.ledger);
	assert_int_equal(ledger_open(&jobs.ledger, path, &e), 0);
	add_ended_job(ENDED_JOBS_MAX + 3);
	add_ended_job(ENDED_JOBS_MAX + 2);
	jobs.ended_job_count = 0;
	add_ended_job(ENDED_JOBS_MAX + 5);
	assert_int_equal(ended_jobs_open(&jobs, &e), 0);
	static const uint64_t last[] = {ENDED_JOBS_MAX + 4, ENDED_JOBS_MAX + 3, ENDED_JOBS_MAX + 2, ENDED_JOBS_MAX + 5};
	for (size_t i = 0; i < 4; i++)
		assert_int_equal(jobs.ended_jobs[ENDED_JOBS_MAX - 4 + i].id, last[i]);
	mem_free(jobs.ended_jobs);
	ledger_close(jobs.ledger);
	spool_close(jobs.spool);
}

static int fail_unlink(const char *path)
{
	(void)path;
	errno = EIO;
	return -1;
}

/* A caller that needs room asks until there is none left to free: films that cannot be deleted now, because an
 * extension reads them or the disk fails, must not be reported as deleted, or the coordinator would ask for ever. */
static void films_that_cannot_be_deleted_make_no_room(void **state)
{
	(void)state;
	struct error e;
	char path[128];
	snprintf(path, sizeof path, "%s/spool", temporary_folder);
	jobs = (struct jobs){0};
	assert_int_equal(spool_open(&jobs.spool, path, &e), 0);
	assert_int_equal(ledger_open(&jobs.ledger, path, &e), 0);
	for (uint64_t id = 1; id <= 3; id++)
		add_ended_job(id);
	make_films();
	struct disk failing_disk = disk_system;
	failing_disk.unlink = fail_unlink;
	disk_set_calls(&failing_disk);
	assert_false(kept_films_drop_all(&jobs));
	disk_set_calls(NULL);
	failing_list_begin("/jobs/j", 1, EIO);
	kept_films_trim(&jobs); /* the size of no job's films is known */
	assert_false(kept_films_drop_all(&jobs));
	failing_list_end();
	for (uint64_t id = 1; id <= 3; id++)
		assert_true(job_file_exists(id, "checkpoint") && job_file_exists(id, "journal.2"));
	jobs.extended_job = &(struct live_job){.id = 1};
	assert_true(kept_films_drop_all(&jobs));
	assert_false(kept_films_drop_all(&jobs));
	assert_true(job_file_exists(1, "checkpoint") && !job_file_exists(2, "checkpoint") &&
		    !job_file_exists(3, "journal.2"));
	ledger_close(jobs.ledger);
	spool_close(jobs.spool);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(films_of_the_oldest_jobs_are_deleted_first, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(latest_ended_jobs_are_known_after_a_start, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(films_that_cannot_be_deleted_make_no_room, temporary_folder_set_up,
						temporary_folder_tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
