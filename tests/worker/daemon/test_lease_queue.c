/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A worker's lease queue with a scripted coordinator: a file needed by several jobs is fetched once, whatever happens
 * to the job that asked first, to the connection or to the disk.
 */
#include "common/base/disk.h"
#include "tests/support/folder.h"
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

static void a_shared_file_comes_once(void **state)
{
	(void)state;
	coord_start(0);
	coord_begin_jobs(3);
	coord_serve_mesh(0, PIECES);
	coord_hear_built(3);
	coord_hear_silence();
	coord_finish();
}

/* The job that asked for a file ends, then the other jobs do. The piece under way belongs to no job, and the next job
 * asks for it again. */
static void the_job_that_asked_may_end(void **state)
{
	(void)state;
	coord_start(0);
	coord_begin_jobs(2);
	coord_serve_mesh(0, 1);
	coord_hear_blob_get(&coord.mesh, PIECE);
	coord_end_job(1);
	coord_send_piece(&coord.mesh, PIECE);
	coord_hear_blob_get(&coord.mesh, 2 * PIECE);
	coord_end_job(2);
	coord_grant(3);
	coord_send_piece(&coord.mesh, 2 * PIECE); /* no job needs this piece now, but it was requested */
	coord_describe(3);
	coord_hear_blob_get(&coord.scenes[2], 0);
	coord_send_piece(&coord.scenes[2], 0);
	coord_serve_mesh(0, PIECES);
	coord_hear_built(1);
	coord_finish();
}

/* A job that arrives while a piece for an ended job is under way continues with this piece. */
static void a_late_job_takes_over(void **state)
{
	(void)state;
	coord_start(0);
	coord_begin_jobs(1);
	coord_serve_mesh(0, 2);
	coord_hear_blob_get(&coord.mesh, 2 * PIECE);
	coord_grant(2);
	coord_end_job(1);
	coord_describe(2);
	coord_hear_blob_get(&coord.scenes[1], 0);
	coord_send_piece(&coord.scenes[1], 0);
	coord_grant(3); /* all earlier messages have been handled by now */
	coord_send_piece(&coord.mesh, 2 * PIECE);
	coord_serve_mesh(3, PIECES);
	coord_hear_built(1);
	coord_finish();
}

static void a_new_connection_goes_on(void **state)
{
	(void)state;
	coord_start(0);
	coord_begin_jobs(2);
	coord_serve_mesh(0, 2);
	coord_hear_blob_get(&coord.mesh, 2 * PIECE);
	coord_hang_up();
	coord_welcome();
	coord_hear_job_get(2);
	coord_hear_job_get(1);
	assert_int_equal(coord_hear()->body_case, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	coord_describe(2);
	coord_describe(1);
	coord_serve_mesh(2, PIECES);
	coord_hear_built(2);
	coord_hang_up();
	coord_welcome(); /* the jobs are gone, and with them their fetches */
	assert_int_equal(coord_hear()->body_case, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	assert_null(coord.agent->fetches);
	coord_finish();
}

/* The coordinator knows nothing of leases of earlier connections, and grants as many as were requested each time. */
static void old_leases_do_not_pile_up(void **state)
{
	(void)state;
	coord_start(0);
	for (uint64_t job = 1; job <= 25; job++) {
		coord_grant(job);
		coord_hang_up();
		coord_welcome();
		while (coord_hear()->body_case == FARM__ENVELOPE__BODY_JOB_GET)
			continue;
	}
	coord_finish();
}

/* A coordinator that has lost its spool grants a lease of another job 1 before the worker knows: the lease is
 * returned, and can be granted again. */
static void another_job_with_the_same_number(void **state)
{
	(void)state;
	coord_start(0);
	coord_begin_jobs(1);
	coord_hear_blob_get(&coord.mesh, 0);
	coord_hang_up();
	coord_welcome();
	coord_hear_job_get(1);
	assert_int_equal(coord_hear()->body_case, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	coord_say_grant(1);
	coord_make_file(&coord.scenes[0], "another", 7);
	coord_describe(1);
	assert_int_equal(coord_hear_failed(""), 1);
	assert_string_equal(coord.at->env.message->lease_failed->text, "");
	coord_grant(1);
	coord_describe(1);
	coord_hear_blob_get(&coord.scenes[0], 0);
	coord_send_piece(&coord.scenes[0], 0);
	coord_serve_mesh(0, PIECES);
	coord_hear_built(1);
	coord_finish();
}

/* Pieces that were not requested, not requested now, or do not exist. */
static void unrequested_pieces_are_refused(void **state)
{
	(void)state;
	for (int i = 0; i < 3; i++) {
		coord_start(0);
		coord_begin_jobs(1);
		coord_hear_blob_get(&coord.mesh, 0);
		if (i == 0)
			coord_send_piece(&coord.scenes[3], 0);
		if (i == 1)
			coord_send_piece(&coord.mesh, PIECE);
		if (i == 2) {
			coord_send_piece(&coord.mesh, 0);
			coord_send_piece(&coord.mesh, 0);
			coord_hear_blob_get(&coord.mesh, PIECE);
		}
		assert_null(coord_hear());
		coord_finish();
		folder_tear_down(NULL);
		folder_set_up(NULL);
	}
}

static void lies_are_noticed(void **state)
{
	(void)state;
	coord_start(0);
	coord_begin_jobs(2);
	coord_serve_mesh(0, PIECES - 1);
	coord_hear_blob_get(&coord.mesh, (PIECES - 1) * PIECE);
	coord.mesh_bytes[MESH - 1] ^= 1;
	coord_send_piece(&coord.mesh, (PIECES - 1) * PIECE);
	coord.mesh_bytes[MESH - 1] ^= 1;
	const uint64_t first = coord_hear_failed("do not match the blob");
	coord_serve_mesh(0, PIECES); /* the other job fetches the file itself */
	assert_int_equal(coord_hear_failed("scene"), 3 - first);
	coord_finish();
}

static void a_store_without_room_fails_each_once(void **state)
{
	(void)state;
	coord_start(MESH - 1);
	coord_begin_jobs(2);
	coord_serve_mesh(0, 1);
	const uint64_t first = coord_hear_failed("exceeds its limit");
	assert_false(coord.own); /* a configured limit: no worker may have room for this file */
	coord_serve_mesh(0, 1);
	assert_int_equal(coord_hear_failed("exceeds its limit"), 3 - first);
	coord_hear_silence();
	coord_finish();
}

static ssize_t write_nothing(int fd, const struct iovec *parts, int count, off_t at)
{
	(void)fd, (void)parts, (void)count, (void)at;
	errno = ENOSPC;
	return -1;
}

static void a_full_disk_is_its_own_fault(void **state)
{
	(void)state;
	struct disk full = disk_system;
	full.pwritev = write_nothing;
	coord_start(0);
	coord_begin_jobs(1);
	coord_hear_blob_get(&coord.mesh, 0);
	disk_use(&full);
	coord_send_piece(&coord.mesh, 0);
	assert_int_equal(coord_hear_failed("No space left on device"), 1);
	assert_true(coord.own);
	disk_use(NULL);
	coord_grant(1); /* with free space again it works */
	coord_describe(1);
	coord_serve_mesh(0, PIECES);
	coord_hear_built(1);
	coord_finish();
}

/* Files in the cache have been deleted. */
static void a_lost_file_is_its_own_fault(void **state)
{
	(void)state;
	char command[128];
	coord_start(0);
	coord_begin_jobs(1);
	coord_serve_mesh(0, PIECES - 1);
	coord_hear_blob_get(&coord.mesh, (PIECES - 1) * PIECE);
	snprintf(command, sizeof command, "rm -f '%s'/slot-0/[0-9a-f]???????*", folder);
	assert_int_equal(system(command), 0);
	coord_send_piece(&coord.mesh, (PIECES - 1) * PIECE);
	coord_hear_failed("No such file");
	assert_true(coord.own);
	coord_finish();
}

#define TEST(f) cmocka_unit_test_setup_teardown(f, folder_set_up, folder_tear_down)

#define TEST(f) cmocka_unit_test_setup_teardown(f, folder_set_up, folder_tear_down)

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(a_shared_file_comes_once),
		TEST(the_job_that_asked_may_end),
		TEST(a_late_job_takes_over),
		TEST(a_new_connection_goes_on),
		TEST(old_leases_do_not_pile_up),
		TEST(another_job_with_the_same_number),
		TEST(unrequested_pieces_are_refused),
		TEST(lies_are_noticed),
		TEST(a_store_without_room_fails_each_once),
		TEST(a_full_disk_is_its_own_fault),
		TEST(a_lost_file_is_its_own_fault),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
