/* SPDX-License-Identifier: Apache-2.0 */
/* Which scenes a worker holds at the same time where memory has not been enough, with a scripted coordinator. */
#include "common/base/mem.h"
#include "worker/daemon/work.h"
#include "tests/support/failing_memory.h"
#include "tests/support/folder.h"
#include "tests/support/scripted_coordinator.h"
#include "tests/support/worlds.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <signal.h>
#include <stdatomic.h>
#include <unistd.h>

/* Two scenes that fit into memory only one after the other would end each rendering process, and neither job would ever
 * be done. */
static void one_scene_at_a_time_where_memory_was_short(void **state)
{
	struct error e;
	(void)state;
	assert_int_equal(work_share(1, &e), 0);
	for (int i = 0; i < 2; i++) {
		coord_start(0);
		coord_grant(1);
		coord_grant(2);
		coord_finish();
		work_lose(i == 0 ? SIGSEGV : SIGKILL); /* a fault of a scene; of the machine */
	}
	coord_start(0);
	coord_grant(1);
	coord_say_grant(2);
	assert_int_equal(coord_hear_failed("memory has no room for its scene beside that of j1"), 2);
	assert_true(coord.own); /* which counts against no job */
	coord_say_revoke(1);
	coord_grant(2); /* the scene of j1 may be wanted again, but it is used by nobody */
	coord_say_grant(1);
	assert_int_equal(coord_hear_failed("beside that of j2"), 1);
	coord_end_job(2);
	coord_grant(1);
	coord_finish();
}

/* Keeps the pool's only thread busy. */
static atomic_bool gate_open;
static void wait_at_gate(struct task *task)
{
	(void)task;
	while (!atomic_load(&gate_open))
		usleep(100);
}

/* The job's world is being built, and one of its first allocations fails. The job is the latest. */
static void run_out_of_memory(uint64_t job)
{
	struct task gate = {.run = wait_at_gate, .done = wait_at_gate /* which is open by then */};
	atomic_store(&gate_open, false);
	thread_pool_add(coord.agent->thread_pool, &gate);
	coord_describe(job);
	if (!blob_has(coord.agent->cache.blobs, &coord.scenes[job - 1].hash, NULL)) {
		coord_hear_blob_get(&coord.scenes[job - 1], 0);
		coord_send_piece(&coord.scenes[job - 1], 0);
	}
	while (coord.agent->job_caches->job != job || coord.agent->job_caches->state != JOB_CACHE_BUILDING)
		uv_run(&coord.agent->loop, UV_RUN_NOWAIT);
	mem_fail_after(20);
	atomic_store(&gate_open, true);
	coord_hear_failed("memory");
	mem_fail_after(-1);
}

/* As above, where the system refuses memory instead: the job whose scene found none beside another's is not at fault,
 * and one whose scene found none alone is. */
static void memory_that_others_had_is_its_own_fault(void **state)
{
	static const char text[] = "<scene version='3.0.0'>" SENSOR(
		"0,0,5", "0,0,0") "<shape type='sphere'/><emitter type='constant'/></scene>\n";
	struct error e;
	(void)state;
	assert_int_equal(work_share(1, &e), 0);
	coord_start(0);
	coord_make_file(&coord.scenes[0], text, sizeof text - 1);
	coord_make_file(&coord.scenes[1], text, sizeof text - 2);
	coord_grant(1);
	coord_describe(1);
	coord_hear_blob_get(&coord.scenes[0], 0);
	coord_send_piece(&coord.scenes[0], 0);
	coord_serve_mesh(0, PIECES);
	assert_int_equal(coord_hear()->body_case, FARM__ENVELOPE__BODY_LEASE_RESULT);
	coord_grant(2);
	run_out_of_memory(2);
	assert_true(coord.own);
	coord_say_grant(3);
	assert_int_equal(coord_hear_failed("memory has no room for its scene beside that of j1"), 3);
	coord_end_job(1);
	coord_grant(2);
	run_out_of_memory(2);
	assert_false(coord.own);
	coord_finish();
}

#define TEST(f) cmocka_unit_test_setup_teardown(f, folder_set_up, folder_tear_down)

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(one_scene_at_a_time_where_memory_was_short),
		TEST(memory_that_others_had_is_its_own_fault),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
