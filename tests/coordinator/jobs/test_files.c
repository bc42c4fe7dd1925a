/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Files of scenes are read again, which takes long: a submission and a worker's complaint wait for the reading, and no
 * other client does.
 */
#include "common/base/log.h"
#include "coordinator/jobs/files.h"
#include "coordinator/store/ledger.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/staged_server.h"

#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static const char scene[] = "<scene/>"; /* even a scene as small as this is read by the pool's threads */

/* Returns a job whose scene has not been read since the start. */
static uint64_t restart_with_a_job(void)
{
	staged_server_start();
	uint64_t job = scripted_peer_submit_with_scene(staged_server.client, &scripted_peer_plan_request, scene);
	staged_server_end(SIGTERM, true);
	staged_disk->hold_read = true;
	staged_disk->read_held = staged_disk->release_read = false;
	staged_server_start();
	return job;
}

static void await_reading(void)
{
	while (!staged_disk->read_held)
		usleep(1000);
}

static void submission_waits_for_the_reading_of_its_files(void **state)
{
	(void)state;
	uint64_t job = restart_with_a_job();
	assert_true(scripted_peer_submit(staged_server.client, &scripted_peer_plan_request, scene));
	await_reading();
	assert_true(scripted_peer_request_job_list(staged_server.client));
	assert_int_equal(scripted_peer_receive(staged_server.client)->body_case, FARM__ENVELOPE__BODY_JOB_LIST_ANSWER);
	staged_disk->release_read = true;
	const Farm__Envelope *m = scripted_peer_receive(staged_server.client);
	assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_SUBMIT_ANSWER);
	assert_string_equal(m->submit_answer->refusal, "");
	assert_int_equal(m->submit_answer->n_missing, 0);
	assert_int_equal(m->submit_answer->job, job + 1);
	staged_server_end(SIGTERM, true);
}

static struct lease_key await_first_lease(void)
{
	struct lease_key k;
	struct error e;
	const Farm__Envelope *m;
	do
		m = scripted_peer_receive(staged_server.worker);
	while (m && m->body_case != FARM__ENVELOPE__BODY_LEASE_GRANT);
	assert_non_null(m);
	assert_int_equal(lease_key_from_wire(m->lease_grant->key, &k, &e), 0);
	return k;
}

/* The scene is damaged, and a worker fails because of it: the job waits for the file, and continues once the file is
 * repaired. */
static void job_with_a_damaged_file_is_held_until_its_repair(void **state)
{
	(void)state;
	char command[200];
	uint64_t job = restart_with_a_job();
	struct lease_key k = await_first_lease();
	snprintf(command, sizeof command, "for f in %s/blobs/*; do printf '<gibberi' >\"$f\"; done",
		 staged_server.spool);
	assert_int_equal(system(command), 0);
	staged_server_fail_lease(&k);
	await_reading();
	staged_server_await_state(job, "bootstrap");
	staged_disk->release_read = true;
	staged_server_await_state(job, "held");
	assert_int_equal(scripted_peer_submit_with_scene(staged_server.client, &scripted_peer_plan_request, scene),
			 job + 1);
	staged_server_end(SIGTERM, true);
}

/* The worker hangs up before the files are read: its failure counts. */
static void failure_of_a_worker_that_left_counts(void **state)
{
	(void)state;
	struct job_record r;
	struct ledger *l;
	struct error e;
	uint64_t job = restart_with_a_job();
	struct lease_key k = await_first_lease();
	staged_server_fail_lease(&k);
	await_reading();
	scripted_peer_disconnect(staged_server.worker);
	staged_server.worker = NULL;
	usleep(STAGED_TWO_TICKS_US);
	staged_disk->release_read = true;
	staged_server_cancel(job);
	staged_server_await_state(job, "cancelled");
	staged_server_end(SIGTERM, true);
	assert_int_equal(ledger_open(&l, staged_server.spool, &e), 0);
	assert_int_equal(ledger_read_record(l, job, &r, &e), 0);
	ledger_close(l);
	assert_int_equal(r.counts.failures, 1);
}

/* A complaint from a worker that does not hold the lease starts no reading of files. */
static void complaint_about_a_lease_not_held_reads_no_files(void **state)
{
	(void)state;
	uint64_t job = restart_with_a_job();
	struct lease_key k = await_first_lease();
	k.epoch++;
	staged_server_fail_lease(&k);
	staged_server_await_state(job, "bootstrap");
	usleep(STAGED_TWO_TICKS_US);
	assert_false(staged_disk->read_held);
	staged_disk->release_read = true;
	staged_server_cancel(job);
	staged_server_end(SIGTERM, true);
}

/* A worker asks for a file that no job has: no job's files are looked at. A search through all jobs would meet one
 * without a submission. */
static void request_for_an_unknown_file_examines_no_job(void **state)
{
	(void)state;
	static struct live_job job;
	static struct jobs jobs;
	struct blob_hash unknown = {{1}};
	struct error e;
	STAILQ_INIT(&jobs.file_checks);
	jobs.live_jobs = &job;
	assert_int_equal(blob_store_open(&jobs.blobs, temporary_folder, 0, &e), 0);
	assert_int_equal(files_check(&jobs, &unknown, &e), -ENOENT);
	assert_false(blob_is_held(jobs.blobs, &unknown));
	assert_int_equal(blob_hold_expected(jobs.blobs, &unknown, &e), 0);
	assert_true(blob_is_held(jobs.blobs, &unknown));
	blob_store_close(jobs.blobs);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(submission_waits_for_the_reading_of_its_files, staged_server_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(job_with_a_damaged_file_is_held_until_its_repair, staged_server_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(failure_of_a_worker_that_left_counts, staged_server_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(complaint_about_a_lease_not_held_reads_no_files, staged_server_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(request_for_an_unknown_file_examines_no_job, temporary_folder_set_up,
						temporary_folder_tear_down),
	};
	log_set_level(LOG_LEVEL_ERROR);
	return staged_server_map_disk() ? 1 : cmocka_run_group_tests(tests, NULL, NULL);
}
