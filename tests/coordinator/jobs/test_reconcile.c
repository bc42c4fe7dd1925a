/* SPDX-License-Identifier: Apache-2.0 */
/* A job's folder without a row in the ledger is deleted only if the folder could be read and nothing was merged in it.
 */
#include "coordinator/jobs/reconcile.h"

#include "common/base/disk.h"
#include "tests/support/failing_list.h"
#include "tests/support/folder.h"

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
	if (folder_set_up(state))
		return -1;
	memset(&jobs, 0, sizeof jobs);
	folder_fault = file_fault = 0;
	snprintf(spool, sizeof spool, "%s/spool", folder);
	jobs.config.spool = spool;
	return spool_open(&jobs.spool, spool, &e) || spool_make_job(jobs.spool, JOB, &e);
}

static int tear_down(void **state)
{
	disk_use(NULL);
	ledger_close(jobs.ledger);
	spool_close(jobs.spool);
	return folder_tear_down(state);
}

static bool is_there(const char *file)
{
	char path[SPOOL_PATH_MAX];
	spool_job_path(jobs.spool, JOB, file, path);
	return access(path, F_OK) == 0;
}

static DIR *own_opendir(const char *path)
{
	if (folder_fault && strstr(path, "/jobs/j")) {
		errno = folder_fault;
		return NULL;
	}
	return disk_system.opendir(path);
}

static int own_stat(const char *path, struct stat *st)
{
	if (file_fault && strstr(path, "/checkpoint")) {
		errno = file_fault;
		return -1;
	}
	return disk_system.stat(path, st);
}

static int start(int folder_error, int file_error)
{
	struct disk own = disk_system;
	own.opendir = own_opendir;
	own.stat = own_stat;
	disk_use(&own);
	folder_fault = folder_error;
	file_fault = file_error;
	int rc = reconcile(&jobs, &e);
	disk_use(NULL);
	ledger_close(jobs.ledger);
	jobs.ledger = NULL;
	return rc;
}

static void a_file_that_cannot_be_read_stops_the_start(void **state)
{
	(void)state;
	assert_int_equal(spool_write(jobs.spool, JOB, "checkpoint", "films", 5, &e), 0);
	static const int faults[] = {EMFILE, EIO, EACCES};
	for (size_t i = 0; i < sizeof faults / sizeof *faults; i++) {
		assert_int_equal(start(faults[i], 0), -faults[i]);
		assert_true(is_there("checkpoint"));
		assert_int_equal(start(0, faults[i]), -faults[i]);
		assert_true(is_there("checkpoint"));
	}
	assert_int_equal(start(0, 0), -EBADMSG); /* the folder is read this time: the job is lost */
	assert_true(is_there("checkpoint"));
}

static void never_accepted(void **state)
{
	(void)state;
	assert_int_equal(start(0, 0), 0);
	assert_false(is_there(NULL));
}

static void listed_in_part(void **state)
{
	(void)state;
	assert_int_equal(spool_write(jobs.spool, JOB, "checkpoint", "films", 5, &e), 0);
	failing_list_begin("/jobs/j", 0, EIO);
	int rc = reconcile(&jobs, &e);
	failing_list_end();
	ledger_close(jobs.ledger);
	jobs.ledger = NULL;
	assert_int_equal(rc, -EIO);
	assert_true(is_there("checkpoint"));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(a_file_that_cannot_be_read_stops_the_start, set_up, tear_down),
		cmocka_unit_test_setup_teardown(never_accepted, set_up, tear_down),
		cmocka_unit_test_setup_teardown(listed_in_part, set_up, tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
