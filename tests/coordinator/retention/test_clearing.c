/* SPDX-License-Identifier: Apache-2.0 */
/* Old finished jobs are deleted, with everything in their folders and their rows, while nobody has to wait for it. */
#include "common/base/disk.h"
#include "common/base/log.h"
#include "coordinator/retention/observed_time.h"
#include "coordinator/retention/clearing.h"
#include "tests/support/bytes_read.h"
#include "tests/support/failing_list.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/ledger_files.h"

#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

enum { JOBS = 120, LIVE_JOB = 7, YOUNG_JOB = 9, DAY = 86400 };

static struct jobs jobs;

/* Opening a file takes 0.2 ms, so looking at 120 jobs takes more than 20 ms. */
static int slow_open(const char *path, int flags, mode_t mode)
{
	usleep(200);
	return disk_system.open(path, flags, mode);
}

static bool nobody_fetches(const struct peers *user, uint64_t job)
{
	(void)user;
	(void)job;
	return false;
}

static int skip_fsync(int fd)
{
	(void)fd;
	return 0;
}

static bool job_file_exists(uint64_t job, const char *file)
{
	char path[SPOOL_PATH_MAX];
	spool_job_path(jobs.spool, job, file, path);
	return access(path, F_OK) == 0;
}

static void write_file(uint64_t job, const char *file)
{
	char path[SPOOL_PATH_MAX];
	spool_job_path(jobs.spool, job, file, path);
	int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0600);
	assert_true(fd >= 0);
	assert_int_equal(write(fd, "bytes", 5), 5);
	close(fd);
}

static void add_ended_job(uint64_t id, double ended)
{
	struct error e;
	struct job_record r;
	struct ledger_job j = {.id = id, .owner = "", .name = "n", .version = "1", .record = ""};
	record_init(&r, id, "n", "");
	strcpy(r.state, "done");
	r.ended = ended;
	r.ended_seen = 100.0 * DAY - (double)time(NULL) + ended;
	r.has_result = true;
	assert_int_equal(ledger_add(jobs.ledger, &j, &e), 0);
	if (id != LIVE_JOB)
		assert_int_equal(ledger_end_job(jobs.ledger, &r, false, &e), 0);
	assert_int_equal(spool_create_job_folder(jobs.spool, id, &e), 0);
	write_file(id, "result.exr");
	write_file(id, "checkpoint.tmp"); /* left by an interrupted run */
}

static void open_jobs(void)
{
	struct error e;
	char path[SPOOL_PATH_MAX];
	memset(&jobs, 0, sizeof jobs);
	jobs.peers.is_result_in_use = nobody_fetches;
	snprintf(path, sizeof path, "%s/spool", temporary_folder);
	assert_int_equal(spool_open(&jobs.spool, path, &e), 0);
	assert_int_equal(ledger_open(&jobs.ledger, path, &e), 0);
	jobs.config.retention_seconds = DAY;
	struct timespec up;
	clock_gettime(CLOCK_BOOTTIME, &up);
	jobs.observed_clock = (struct age_clock){.observed_seconds = 100.0 * DAY, .uptime = (double)up.tv_sec};
}

/* Starts as a coordinator does after a reboot that has set the wall clock ahead by this many seconds. */
static void restart_after_reboot(double ahead)
{
	struct age_clock last = {.observed_seconds = 100.0 * DAY,
				 .uptime = 1e9,
				 .wall_time = (double)time(NULL) - ahead,
				 .boot_id = "the-one-before"};
	struct error e;
	char text[AGE_CLOCK_TEXT_MAX];
	age_clock_to_text(&last, text);
	assert_int_equal(ledger_set_note(jobs.ledger, "clock", text, &e), 0);
	observed_time_open(&jobs);
	jobs.next_clearing_at = 0;
	do
		clearing_tick(&jobs);
	while (jobs.clearing);
}

/* A clock that jumps by years, and back, removes nothing young; and of three results for which there is too little
 * space it removes only the oldest. */
static void jumps_of_the_wall_clock_remove_nothing(void **state)
{
	(void)state;
	static const double jumps[] = {10 * 365.0 * DAY, -10 * 365.0 * DAY, 2.0 * DAY, -2.0 * DAY};
	double now = (double)time(NULL);
	for (int days = 0; days <= 2; days++) { /* 0: a quarter of a day */
		open_jobs();
		jobs.config.retention_seconds = days ? days * (double)DAY : DAY / 4;
		for (uint64_t id = 1; id <= 3; id++)
			add_ended_job(id, now - 60 * (double)(4 - id));
		for (unsigned k = 0; k < sizeof jumps / sizeof *jumps; k++) {
			restart_after_reboot(jumps[k]);
			for (uint64_t id = 1; id <= 3; id++)
				assert_true(job_file_exists(id, "result.exr") == (id > 1 || k == 0 || days == 0));
			jobs.config.retention_bytes = days ? 10 : 0; /* room for two results */
		}
		ledger_close(jobs.ledger);
		spool_close(jobs.spool);
		temporary_folder_tear_down(NULL);
		temporary_folder_set_up(NULL);
	}
}

/* The last half hour of observed time was not stored when power was lost: a job that ended then is nevertheless older
 * than one that ends now. */
static void order_of_ends_survives_a_loss_of_power(void **state)
{
	(void)state;
	double now = (double)time(NULL);
	open_jobs();
	add_ended_job(1, now + 1800);
	restart_after_reboot(-(double)DAY);
	assert_true(job_file_exists(1, "result.exr"));
	add_ended_job(2, now);
	jobs.config.retention_bytes = 5; /* room for one result */
	jobs.next_clearing_at = 0;
	do
		clearing_tick(&jobs);
	while (jobs.clearing);
	assert_true(!job_file_exists(1, "result.exr") && job_file_exists(2, "result.exr"));
	ledger_close(jobs.ledger);
	spool_close(jobs.spool);
}

static void old_jobs_are_deleted_in_short_ticks(void **state)
{
	(void)state;
	struct disk slow = disk_system;
	struct ledger_job j;
	struct error e;
	double now = (double)time(NULL), longest = 0;
	unsigned ticks = 0;
	slow.fsync = skip_fsync;
	disk_set_calls(&slow);
	open_jobs();
	for (uint64_t id = 1; id <= JOBS; id++)
		add_ended_job(id, now - (id == YOUNG_JOB ? 2 : 20) * DAY);
	slow.open = slow_open;
	do {
		double begin = jobs_now(&jobs);
		clearing_tick(&jobs);
		double took = jobs_now(&jobs) - begin;
		longest = took > longest ? took : longest;
		ticks++;
	} while (jobs.clearing);
	disk_set_calls(NULL);
	print_message("   %d jobs in %u ticks, the longest %.1f ms\n", JOBS, ticks, 1e3 * longest);
	assert_true(ticks >= 5);
	for (uint64_t id = 1; id <= JOBS; id++) {
		bool stays = id == LIVE_JOB || id == YOUNG_JOB;
		assert_true(job_file_exists(id, NULL) == stays);
		assert_int_equal(ledger_read_row(jobs.ledger, id, &j, &e), stays);
	}
	assert_true(!job_file_exists(YOUNG_JOB, "result.exr") && job_file_exists(LIVE_JOB, "result.exr"));
	ledger_close(jobs.ledger);
	spool_close(jobs.spool);
}

/* With rows as large as those of real jobs: nobody waits until all rows are read, nor until all are deleted. */
static void many_rows_are_read_in_short_ticks(void **state)
{
	(void)state;
	enum { ROWS = 4000, MB = 1 << 20 };
	uint64_t before, after, longest = 0;
	char sql[600];
	open_jobs();
	ledger_close(jobs.ledger);
	spool_close(jobs.spool);
	snprintf(
		sql, sizeof sql,
		"WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < %d)"
		" INSERT INTO jobs (id, owner, name, version, priority, mixed, state, submitted, ended, record, checksum)"
		" SELECT i, '', '', '', 0, 0, 'done', 0, 1, printf('%%.3800c', 'x'), -1 FROM n",
		ROWS);
	ledger_files_execute("spool/jobs.db", sql);
	open_jobs();
	if (!bytes_read_count(&before))
		skip();
	const uint64_t begin = before;
	do {
		clearing_tick(&jobs);
		assert_true(bytes_read_count(&after));
		longest = after - before > longest ? after - before : longest;
		before = after;
	} while (jobs.clearing);
	print_message("   %d rows: %d KB, of which %d in one tick\n", ROWS, (int)((before - begin) >> 10),
		      (int)(longest >> 10));
	assert_true(before - begin > 12 * MB); /* all rows were looked at */
	assert_true(longest < 8 * MB);
	ledger_close(jobs.ledger);
	spool_close(jobs.spool);
}

/* Records of an earlier version, and of a run whose clock was ahead, count as young as they can be. */
static void job_of_unknown_age_counts_as_young(void **state)
{
	(void)state;
	struct disk quick = disk_system;
	struct error e;
	struct job_record *r = calloc(1, sizeof *r);
	quick.fsync = skip_fsync;
	disk_set_calls(&quick);
	open_jobs();
	for (uint64_t id = 1; id <= 2; id++) {
		add_ended_job(id, (double)time(NULL) - 20 * DAY);
		assert_int_equal(ledger_read_record(jobs.ledger, id, r, &e), 0);
		r->ended_seen = id == 1 ? -1 : 1000.0 * DAY;
		assert_int_equal(ledger_write_record(jobs.ledger, r, &e), 0);
	}
	for (int day = 0; day < 3;
	     day++, jobs.observed_clock.observed_seconds += 0.7 * DAY, jobs.next_clearing_at = 0) {
		do
			clearing_tick(&jobs);
		while (jobs.clearing);
		for (uint64_t id = 1; id <= 2; id++) {
			assert_true(job_file_exists(id, "result.exr") == (day < 2));
			assert_int_equal(ledger_read_record(jobs.ledger, id, r, &e), 0);
			assert_true(r->ended_seen >= 100.0 * DAY && r->ended_seen < 100.0 * DAY + 100);
		}
	}
	disk_set_calls(NULL);
	free(r);
	ledger_close(jobs.ledger);
	spool_close(jobs.spool);
}

/* A job that was extended and ended again between the start and the end of the search stays. */
static void job_that_changed_meanwhile_stays(void **state)
{
	(void)state;
	struct disk slow = disk_system;
	double now = (double)time(NULL);
	slow.fsync = skip_fsync;
	slow.open = slow_open;
	disk_set_calls(&slow);
	open_jobs();
	for (uint64_t id = 1; id <= JOBS; id++)
		add_ended_job(id, now - 20 * DAY);
	clearing_tick(&jobs);
	assert_non_null(jobs.clearing);
	struct error e;
	struct job_record *r = calloc(1, sizeof *r);
	assert_int_equal(ledger_read_record(jobs.ledger, 1, r, &e), 0);
	r->ended_seen += 20 * DAY;
	assert_int_equal(ledger_write_record(jobs.ledger, r, &e), 0);
	free(r);
	while (jobs.clearing)
		clearing_tick(&jobs);
	disk_set_calls(NULL);
	assert_true(job_file_exists(1, "result.exr") && !job_file_exists(2, NULL));
	clearing_close(&jobs);
	ledger_close(jobs.ledger);
	spool_close(jobs.spool);
}

/* Films that are read while the search goes on stay; so do films that are read while the chosen ones are deleted. */
static void films_being_read_stay(void **state)
{
	(void)state;
	struct disk slow = disk_system;
	struct live_job first = {.id = 3}, second = {.id = JOBS};
	slow.fsync = skip_fsync;
	slow.open = slow_open;
	disk_set_calls(&slow);
	open_jobs();
	for (uint64_t id = 1; id <= JOBS; id++)
		add_ended_job(id, (double)time(NULL) - 20 * DAY);
	jobs.extended_job = &first;
	do { /* the last job goes in a later tick than the first: looking at 120 jobs takes more than one tick */
		clearing_tick(&jobs);
		if (!job_file_exists(1, "result.exr"))
			jobs.extended_job = &second;
	} while (jobs.clearing);
	disk_set_calls(NULL);
	assert_true(job_file_exists(3, "result.exr") && job_file_exists(JOBS, "result.exr") &&
		    !job_file_exists(1, NULL) && !job_file_exists(2, NULL) && !job_file_exists(4, NULL));
	ledger_close(jobs.ledger);
	spool_close(jobs.spool);
}

static bool is_fetching;
static bool somebody_fetches(const struct peers *user, uint64_t job)
{
	(void)user;
	return is_fetching && job == 1;
}

/* When space is short, a result that a client waits for stays until it was fetched, and goes soon afterwards rather
 * than after an hour. */
static void result_being_fetched_is_deleted_afterwards(void **state)
{
	(void)state;
	struct disk quick = disk_system;
	quick.fsync = skip_fsync;
	disk_set_calls(&quick);
	open_jobs();
	jobs.peers.is_result_in_use = somebody_fetches;
	jobs.config.retention_seconds = 0;
	jobs.config.retention_bytes = 1;
	add_ended_job(1, (double)time(NULL));
	add_ended_job(2, (double)time(NULL) - DAY);
	for (int fetching = 1; fetching >= 0; fetching--) {
		is_fetching = fetching;
		jobs.next_clearing_at = 0;
		do
			clearing_tick(&jobs);
		while (jobs.clearing);
		assert_true(job_file_exists(1, "result.exr") == fetching && !job_file_exists(2, "result.exr"));
		assert_true((jobs.next_clearing_at - jobs_now(&jobs) < 10) == fetching);
	}
	disk_set_calls(NULL);
	ledger_close(jobs.ledger);
	spool_close(jobs.spool);
}

/* A folder without a row would be taken for a lost job, and the next start would be refused: the row stays until the
 * folder is gone. */
static void row_stays_until_its_folder_is_gone(void **state)
{
	(void)state;
	struct error e;
	struct ledger_job j;
	open_jobs();
	jobs.config.retention_seconds = DAY;
	add_ended_job(1, (double)time(NULL) - 90 * DAY);
	for (int round = 0; round < 2; round++) {
		if (round == 0)
			failing_list_begin("/jobs/j1", 0, EIO);
		jobs.next_clearing_at = 0;
		do
			clearing_tick(&jobs);
		while (jobs.clearing);
		failing_list_end();
		assert_int_equal(job_file_exists(1, NULL), round == 0);
		assert_int_equal(ledger_read_row(jobs.ledger, 1, &j, &e), round == 0);
	}
	ledger_close(jobs.ledger);
	spool_close(jobs.spool);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(jumps_of_the_wall_clock_remove_nothing, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(order_of_ends_survives_a_loss_of_power, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(old_jobs_are_deleted_in_short_ticks, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(many_rows_are_read_in_short_ticks, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(job_of_unknown_age_counts_as_young, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(job_that_changed_meanwhile_stays, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(films_being_read_stay, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(result_being_fetched_is_deleted_afterwards, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(row_stays_until_its_folder_is_gone, temporary_folder_set_up,
						temporary_folder_tear_down),
	};
	log_set_level(LOG_LEVEL_ERROR);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
