/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A worker's lease queue with a scripted coordinator: a file needed by several jobs is fetched once, whatever happens
 * to the job that asked first, to the connection or to the disk.
 */
#include "common/base/disk.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/scripted_coordinator.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void shared_file_is_fetched_once(void **state)
{
	(void)state;
	coord_start(0);
	coord_begin_jobs(3);
	coord_serve_mesh(0, COORD_MESH_PIECES);
	coord_expect_built_jobs(3);
	coord_expect_silence();
	coord_stop();
}

/* The job that asked for a file ends, then the other jobs do. The piece under way belongs to no job, and the next job
 * asks for it again. */
static void fetch_survives_the_end_of_its_job(void **state)
{
	(void)state;
	coord_start(0);
	coord_begin_jobs(2);
	coord_serve_mesh(0, 1);
	coord_expect_blob_get(&coord.mesh, COORD_PIECE_BYTES);
	coord_send_job_end(1);
	coord_send_piece(&coord.mesh, COORD_PIECE_BYTES);
	coord_expect_blob_get(&coord.mesh, 2 * COORD_PIECE_BYTES);
	coord_send_job_end(2);
	coord_grant_new_job(3);
	coord_send_piece(&coord.mesh, 2 * COORD_PIECE_BYTES); /* no job needs this piece now, but it was requested */
	coord_send_job_info(3);
	coord_expect_blob_get(&coord.scenes[2], 0);
	coord_send_piece(&coord.scenes[2], 0);
	coord_serve_mesh(0, COORD_MESH_PIECES);
	coord_expect_built_jobs(1);
	coord_stop();
}

/* A job that arrives while a piece for an ended job is under way continues with this piece. */
static void late_job_takes_over_a_fetch(void **state)
{
	(void)state;
	coord_start(0);
	coord_begin_jobs(1);
	coord_serve_mesh(0, 2);
	coord_expect_blob_get(&coord.mesh, 2 * COORD_PIECE_BYTES);
	coord_grant_new_job(2);
	coord_send_job_end(1);
	coord_send_job_info(2);
	coord_expect_blob_get(&coord.scenes[1], 0);
	coord_send_piece(&coord.scenes[1], 0);
	coord_grant_new_job(3); /* all earlier messages have been handled by now */
	coord_send_piece(&coord.mesh, 2 * COORD_PIECE_BYTES);
	coord_serve_mesh(3, COORD_MESH_PIECES);
	coord_expect_built_jobs(1);
	coord_stop();
}

static void fetch_continues_on_a_new_connection(void **state)
{
	(void)state;
	coord_start(0);
	coord_begin_jobs(2);
	coord_serve_mesh(0, 2);
	coord_expect_blob_get(&coord.mesh, 2 * COORD_PIECE_BYTES);
	coord_disconnect();
	coord_accept_worker();
	coord_expect_job_get(2);
	coord_expect_job_get(1);
	assert_int_equal(coord_receive()->body_case, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	coord_send_job_info(2);
	coord_send_job_info(1);
	coord_serve_mesh(2, COORD_MESH_PIECES);
	coord_expect_built_jobs(2);
	coord_disconnect();
	coord_accept_worker(); /* the jobs are gone, and with them their fetches */
	assert_int_equal(coord_receive()->body_case, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	assert_null(coord.agent->fetches);
	coord_stop();
}

/* The coordinator knows nothing of leases of earlier connections, and grants as many as were requested each time. */
static void old_leases_do_not_pile_up(void **state)
{
	(void)state;
	coord_start(0);
	for (uint64_t job = 1; job <= 25; job++) {
		coord_grant_new_job(job);
		coord_disconnect();
		coord_accept_worker();
		while (coord_receive()->body_case == FARM__ENVELOPE__BODY_JOB_GET)
			continue;
	}
	coord_stop();
}

/* A coordinator that has lost its spool grants a lease of another job 1 before the worker knows: the lease is
 * returned, and can be granted again. */
static void lease_of_another_job_with_the_same_number_is_returned(void **state)
{
	(void)state;
	coord_start(0);
	coord_begin_jobs(1);
	coord_expect_blob_get(&coord.mesh, 0);
	coord_disconnect();
	coord_accept_worker();
	coord_expect_job_get(1);
	assert_int_equal(coord_receive()->body_case, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	coord_send_grant(1);
	coord_make_file(&coord.scenes[0], "another", 7);
	coord_send_job_info(1);
	assert_int_equal(coord_expect_lease_failed(""), 1);
	assert_string_equal(coord.connection->env.message->lease_failed->text, "");
	coord_grant_new_job(1);
	coord_send_job_info(1);
	coord_expect_blob_get(&coord.scenes[0], 0);
	coord_send_piece(&coord.scenes[0], 0);
	coord_serve_mesh(0, COORD_MESH_PIECES);
	coord_expect_built_jobs(1);
	coord_stop();
}

/* Pieces that were not requested, not requested now, or do not exist. */
static void unrequested_pieces_are_refused(void **state)
{
	(void)state;
	for (int i = 0; i < 3; i++) {
		coord_start(0);
		coord_begin_jobs(1);
		coord_expect_blob_get(&coord.mesh, 0);
		if (i == 0)
			coord_send_piece(&coord.scenes[3], 0);
		if (i == 1)
			coord_send_piece(&coord.mesh, COORD_PIECE_BYTES);
		if (i == 2) {
			coord_send_piece(&coord.mesh, 0);
			coord_send_piece(&coord.mesh, 0);
			coord_expect_blob_get(&coord.mesh, COORD_PIECE_BYTES);
		}
		assert_null(coord_receive());
		coord_stop();
		temporary_folder_tear_down(NULL);
		temporary_folder_set_up(NULL);
	}
}

static void damaged_file_fails_one_job_and_is_fetched_again(void **state)
{
	(void)state;
	coord_start(0);
	coord_begin_jobs(2);
	coord_serve_mesh(0, COORD_MESH_PIECES - 1);
	coord_expect_blob_get(&coord.mesh, (COORD_MESH_PIECES - 1) * COORD_PIECE_BYTES);
	coord.mesh_bytes[COORD_MESH_BYTES - 1] ^= 1;
	coord_send_piece(&coord.mesh, (COORD_MESH_PIECES - 1) * COORD_PIECE_BYTES);
	coord.mesh_bytes[COORD_MESH_BYTES - 1] ^= 1;
	const uint64_t first = coord_expect_lease_failed("do not match the blob");
	coord_serve_mesh(0, COORD_MESH_PIECES); /* the other job fetches the file itself */
	assert_int_equal(coord_expect_lease_failed("scene"), 3 - first);
	coord_stop();
}

static void full_store_fails_each_job_once(void **state)
{
	(void)state;
	coord_start(COORD_MESH_BYTES - 1);
	coord_begin_jobs(2);
	coord_serve_mesh(0, 1);
	const uint64_t first = coord_expect_lease_failed("exceeds its limit");
	assert_false(coord.worker_at_fault); /* a configured limit: no worker may have room for this file */
	coord_serve_mesh(0, 1);
	assert_int_equal(coord_expect_lease_failed("exceeds its limit"), 3 - first);
	coord_expect_silence();
	coord_stop();
}

static ssize_t fail_pwritev(int fd, const struct iovec *parts, int count, off_t at)
{
	(void)fd, (void)parts, (void)count, (void)at;
	errno = ENOSPC;
	return -1;
}

static void full_disk_does_not_count_against_the_job(void **state)
{
	(void)state;
	struct disk full = disk_system;
	full.pwritev = fail_pwritev;
	coord_start(0);
	coord_begin_jobs(1);
	coord_expect_blob_get(&coord.mesh, 0);
	disk_set_calls(&full);
	coord_send_piece(&coord.mesh, 0);
	assert_int_equal(coord_expect_lease_failed("No space left on device"), 1);
	assert_true(coord.worker_at_fault);
	disk_set_calls(NULL);
	coord_grant_new_job(1); /* with free space again it works */
	coord_send_job_info(1);
	coord_serve_mesh(0, COORD_MESH_PIECES);
	coord_expect_built_jobs(1);
	coord_stop();
}

/* Files in the cache have been deleted. */
static void lost_file_does_not_count_against_the_job(void **state)
{
	(void)state;
	char command[128];
	coord_start(0);
	coord_begin_jobs(1);
	coord_serve_mesh(0, COORD_MESH_PIECES - 1);
	coord_expect_blob_get(&coord.mesh, (COORD_MESH_PIECES - 1) * COORD_PIECE_BYTES);
	snprintf(command, sizeof command, "rm -f '%s'/slot-0/[0-9a-f]???????*", temporary_folder);
	assert_int_equal(system(command), 0);
	coord_send_piece(&coord.mesh, (COORD_MESH_PIECES - 1) * COORD_PIECE_BYTES);
	coord_expect_lease_failed("No such file");
	assert_true(coord.worker_at_fault);
	coord_stop();
}

#define TEST(f) cmocka_unit_test_setup_teardown(f, temporary_folder_set_up, temporary_folder_tear_down)

#define TEST(f) cmocka_unit_test_setup_teardown(f, temporary_folder_set_up, temporary_folder_tear_down)

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(shared_file_is_fetched_once),
		TEST(fetch_survives_the_end_of_its_job),
		TEST(late_job_takes_over_a_fetch),
		TEST(fetch_continues_on_a_new_connection),
		TEST(old_leases_do_not_pile_up),
		TEST(lease_of_another_job_with_the_same_number_is_returned),
		TEST(unrequested_pieces_are_refused),
		TEST(damaged_file_fails_one_job_and_is_fetched_again),
		TEST(full_store_fails_each_job_once),
		TEST(full_disk_does_not_count_against_the_job),
		TEST(lost_file_does_not_count_against_the_job),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
