/* SPDX-License-Identifier: Apache-2.0 */
/* A job's folder without a row in the ledger is deleted only if the folder could be read and nothing was merged in it.
 */
#include "coordinator/jobs/reconcile.h"

#include "common/base/disk.h"
#include "tests/support/failing_list.h"
#include "tests/support/temporary_folder.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { JOB = 3 };
static struct jobs jobs;
static struct error e;
static int folder_fault, file_fault; /* errno of the fault; 0: none */

static int set_up(void **state)
{
	static char spool[128];
	if (temporary_folder_set_up(state))
		return -1;
	memset(&jobs, 0, sizeof jobs);
	folder_fault = file_fault = 0;
	snprintf(spool, sizeof spool, "%s/spool", temporary_folder);
	jobs.config.spool_folder = spool;
	return spool_open(&jobs.spool, spool, &e) || spool_create_job_folder(jobs.spool, JOB, &e);
}

static int tear_down(void **state)
{
	disk_set_calls(NULL);
	ledger_close(jobs.ledger);
	spool_close(jobs.spool);
	return temporary_folder_tear_down(state);
}

static bool job_file_exists(const char *file)
{
	char path[SPOOL_PATH_MAX];
	spool_job_path(jobs.spool, JOB, file, path);
	return access(path, F_OK) == 0;
}

static DIR *faulty_opendir(const char *path)
{
	if (folder_fault && strstr(path, "/jobs/j")) {
		errno = folder_fault;
		return NULL;
	}
	return disk_system.opendir(path);
}

static int faulty_stat(const char *path, struct stat *st)
{
	if (file_fault && strstr(path, "/checkpoint")) {
		errno = file_fault;
		return -1;
	}
	return disk_system.stat(path, st);
}

static int reconcile_with_faults(int folder_error, int file_error)
{
	struct disk faulty_calls = disk_system;
	faulty_calls.opendir = faulty_opendir;
	faulty_calls.stat = faulty_stat;
	disk_set_calls(&faulty_calls);
	folder_fault = folder_error;
	file_fault = file_error;
	int rc = reconcile_spool(&jobs, &e);
	disk_set_calls(NULL);
	ledger_close(jobs.ledger);
	jobs.ledger = NULL;
	return rc;
}

static void unreadable_file_stops_the_start(void **state)
{
	(void)state;
	assert_int_equal(spool_write_job_file(jobs.spool, JOB, "checkpoint", "films", 5, &e), 0);
	static const int faults[] = {EMFILE, EIO, EACCES};
	for (size_t i = 0; i < sizeof faults / sizeof *faults; i++) {
		assert_int_equal(reconcile_with_faults(faults[i], 0), -faults[i]);
		assert_true(job_file_exists("checkpoint"));
		assert_int_equal(reconcile_with_faults(0, faults[i]), -faults[i]);
		assert_true(job_file_exists("checkpoint"));
	}
	assert_int_equal(reconcile_with_faults(0, 0), -EBADMSG); /* the folder is read this time: the job is lost */
	assert_true(job_file_exists("checkpoint"));
}

static void job_that_was_never_accepted_is_deleted(void **state)
{
	(void)state;
	assert_int_equal(reconcile_with_faults(0, 0), 0);
	assert_false(job_file_exists(NULL));
}

static void partial_listing_stops_the_start(void **state)
{
	(void)state;
	assert_int_equal(spool_write_job_file(jobs.spool, JOB, "checkpoint", "films", 5, &e), 0);
	failing_list_begin("/jobs/j", 0, EIO);
	int rc = reconcile_spool(&jobs, &e);
	failing_list_end();
	ledger_close(jobs.ledger);
	jobs.ledger = NULL;
	assert_int_equal(rc, -EIO);
	assert_true(job_file_exists("checkpoint"));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(unreadable_file_stops_the_start, set_up, tear_down),
		cmocka_unit_test_setup_teardown(job_that_was_never_accepted_is_deleted, set_up, tear_down),
		cmocka_unit_test_setup_teardown(partial_listing_stops_the_start, set_up, tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
