/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Which scenes a worker holds at the same time after memory ran short, with a scripted coordinator: one at a time for
 * ten minutes, twice as long if it happens again, then all. Leases of a waiting scene are returned, and no job fails
 * because of it.
 */
#include "common/base/clock.h"
#include "common/base/mem.h"
#include "worker/daemon/lease_queue.h"
#include "worker/daemon/crash_record.h"
#include "tests/support/failing_memory.h"
#include "tests/support/temporary_folder.h"
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

/* Starts a worker whose rendering process has just been killed by SIGKILL. */
static void start_short_of_memory(void)
{
	struct error e;
	assert_int_equal(crash_record_open(1, &e), 0);
	crash_record_add_loss(SIGKILL, clock_seconds());
	coord_start(0);
}

static void expect_postponed(uint64_t job, const char *why)
{
	assert_int_equal(coord_expect_lease_failed(why), job);
	assert_true(coord.worker_at_fault); /* the failure does not count against the job */
	assert_true(coord.connection->env.message->lease_failed->later);
}

/* Two scenes that fit into memory only one at a time would kill each rendering process, so that neither job would
 * ever be done. */
static void one_scene_at_a_time_where_memory_was_short(void **state)
{
	struct error e;
	(void)state;
	assert_int_equal(crash_record_open(1, &e), 0);
	coord_start(0);
	coord_grant_new_job(1);
	coord_grant_new_job(2);
	coord_stop();
	crash_record_add_loss(SIGSEGV, clock_seconds()); /* the fault of a scene, not of the machine */
	coord_start(0);
	coord_grant_new_job(1);
	coord_grant_new_job(2);
	coord_stop();
	start_short_of_memory();
	coord_grant_new_job(1);
	coord_send_grant(2);
	expect_postponed(2, "memory ran short, so it holds one scene at a time, now that of j1");
	coord_send_revoke(1);
	coord_grant_new_job(2); /* j1 has no lease, so its scene may be dropped */
	coord_send_grant(1);
	expect_postponed(1, "now that of j2");
	coord_send_job_end(2);
	coord_grant_new_job(1);
	coord_stop();
}

/* The scene in memory must give way however many leases its job is granted: it gets no new ones, and once it is
 * unused the other job's scene is built. */
static void scene_makes_way_for_a_waiting_one(void **state)
{
	(void)state;
	start_short_of_memory();
	coord_grant_new_job(1);
	coord_send_grant(2);
	expect_postponed(2, "now that of j1");
	coord.agent->scene_turn.waiting_since -= 299; /* as if this time had passed */
	coord_send_revoke(1);
	coord_send_grant(1);
	coord_send_grant(2);
	expect_postponed(2, "now that of j1");
	coord.agent->scene_turn.waiting_since -= 2;
	coord_send_revoke(1);
	coord_send_grant(1);
	expect_postponed(1, "this one makes way for another job's");
	coord_grant_new_job(2);
	coord_send_grant(1);
	expect_postponed(1, "now that of j2");
	coord.agent->scene_turn.waiting_since -= 301;
	coord.agent->scene_turn.last_refused_at -= 61; /* j1 has not been granted a lease for this time */
	coord_send_revoke(2);
	coord_send_grant(2);
	coord_send_grant(1);
	expect_postponed(1, "now that of j2");
	coord_stop();
}

/* The restriction ends after ten minutes; each time memory runs short again within the same time, the next period is
 * twice as long. */
static void restriction_ends_and_doubles_when_repeated(void **state)
{
	struct error e;
	(void)state;
	assert_int_equal(crash_record_open(1, &e), 0);
	assert_false(crash_record_is_memory_short(0));
	crash_record_add_loss(SIGKILL, 1000);
	assert_true(crash_record_is_memory_short(1599));
	assert_false(crash_record_is_memory_short(1601));
	crash_record_note_memory_short(1700);
	assert_true(crash_record_is_memory_short(2899));
	assert_false(crash_record_is_memory_short(2901));
	crash_record_note_memory_short(4101); /* the same time has passed without a shortage: ten minutes */
	assert_true(crash_record_is_memory_short(4700));
	crash_record_add_loss(SIGKILL, 4700); /* within the period: it restarts with the same length */
	assert_true(crash_record_is_memory_short(5299));
	assert_false(crash_record_is_memory_short(5301));
	double start = 5300, duration = 600; /* the last period began at 4700 */
	for (int i = 0; i < 8; i++) {
		duration = 2 * duration < 19200 ? 2 * duration : 19200;
		crash_record_note_memory_short(start);
		start += duration;
	}
	assert_true(crash_record_is_memory_short(start - 1));
	assert_false(crash_record_is_memory_short(start + 1));
}

/* After the period, both jobs are accepted again. */
static void both_scenes_are_accepted_afterwards(void **state)
{
	struct error e;
	(void)state;
	assert_int_equal(crash_record_open(1, &e), 0);
	crash_record_add_loss(SIGKILL, clock_seconds() - 601);
	coord_start(0);
	coord_grant_new_job(1);
	coord_grant_new_job(2);
	coord_stop();
}

/* A task that keeps the pool's only thread busy until gate_open. */
static atomic_bool gate_open;
static void wait_at_gate(struct task *task)
{
	(void)task;
	while (!atomic_load(&gate_open))
		usleep(100);
}

/* Builds the world of the latest job, while one of the first allocations fails. */
static void build_without_memory(uint64_t job)
{
	struct task gate = {.run = wait_at_gate, .on_done = wait_at_gate /* done: the gate is open by then */};
	atomic_store(&gate_open, false);
	thread_pool_add(coord.agent->thread_pool, &gate);
	coord_send_job_info(job);
	if (!blob_is_stored(coord.agent->cache.blobs, &coord.scenes[job - 1].hash, NULL)) {
		coord_expect_blob_get(&coord.scenes[job - 1], 0);
		coord_send_piece(&coord.scenes[job - 1], 0);
	}
	while (coord.agent->job_caches->job != job || coord.agent->job_caches->state != JOB_CACHE_BUILDING)
		uv_run(&coord.agent->loop, UV_RUN_NOWAIT);
	mem_fail_after(20);
	atomic_store(&gate_open, true);
	coord_expect_lease_failed("memory");
	mem_fail_after(-1);
}

static const char small_scene[] =
	"<scene version='3.0.0'>" SENSOR("0,0,5", "0,0,0") "<shape type='sphere'/><emitter type='constant'/></scene>\n";

/* Both scenes are files of the coordinator, and the worker has computed a lease of the first. */
static void compute_first_of_two(void)
{
	coord_make_file(&coord.scenes[0], small_scene, sizeof small_scene - 1);
	coord_make_file(&coord.scenes[1], small_scene, sizeof small_scene - 2);
	coord_grant_new_job(1);
	coord_send_job_info(1);
	coord_expect_blob_get(&coord.scenes[0], 0);
	coord_send_piece(&coord.scenes[0], 0);
	coord_serve_mesh(0, COORD_MESH_PIECES);
	assert_int_equal(coord_receive()->body_case, FARM__ENVELOPE__BODY_LEASE_RESULT);
}

/* A lease of an ended job is still on its thread. Another job is not refused, because the coordinator would offer it
 * again only after 10 s: its files are fetched, and its scene waits. Returns the lease; its thread stops afterwards. */
static struct lease_task *start_beside_a_running_thread(struct job_cache **next)
{
	start_short_of_memory();
	compute_first_of_two();
	struct lease_task *l = coord.agent->leases;
	l->state = LEASE_QUEUED; /* as if its thread were still computing it */
	coord_send_job_end(1);
	coord_grant_new_job(2);
	assert_true(l->is_unwanted);
	coord_send_job_info(2);
	coord_expect_blob_get(&coord.scenes[1], 0);
	coord_send_piece(&coord.scenes[1], 0);
	while (!(*next = job_cache_find(coord.agent->job_caches, 2))->is_held || !(*next)->is_held[0])
		uv_run(&coord.agent->loop, UV_RUN_NOWAIT);
	assert_int_equal((*next)->state, JOB_CACHE_FETCHING);
	return l;
}

static void scene_waits_for_a_thread_that_has_yet_to_stop(void **state)
{
	struct job_cache *next;
	(void)state;
	struct lease_task *l = start_beside_a_running_thread(&next);
	l->task.on_done(&l->task);
	assert_null(job_cache_find(coord.agent->job_caches, 1));
	assert_int_equal(coord_receive()->body_case, FARM__ENVELOPE__BODY_LEASE_RESULT);
	coord_stop();
}

/* A worker that leaves has returned the leases of the waiting scene, and must not build it. */
static void leaving_worker_builds_no_scene(void **state)
{
	struct job_cache *next;
	(void)state;
	struct lease_task *l = start_beside_a_running_thread(&next);
	coord.agent->is_leaving = true;
	lease_queue_return_unstarted(coord.agent);
	l->task.on_done(&l->task);
	assert_null(coord.agent->leases);
	assert_int_equal(next->state, JOB_CACHE_FETCHING);
	coord_stop();
}

/* Like a shortage that kills the process, but the system refuses memory. No job is at fault, whether or not its scene
 * was the only one; if it was not, the worker holds one scene at a time afterwards. */
static void lack_of_memory_is_no_jobs_fault(void **state)
{
	struct error e;
	(void)state;
	assert_int_equal(crash_record_open(1, &e), 0);
	coord_start(0);
	compute_first_of_two();
	coord_grant_new_job(2);
	build_without_memory(2);
	assert_true(coord.worker_at_fault);
	coord_send_grant(3);
	expect_postponed(3, "now that of j1");
	coord_send_job_end(1);
	coord_grant_new_job(2);
	build_without_memory(2);
	assert_true(coord.worker_at_fault);
	coord_stop();
}

#define TEST(f) cmocka_unit_test_setup_teardown(f, temporary_folder_set_up, temporary_folder_tear_down)

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(one_scene_at_a_time_where_memory_was_short),
		TEST(scene_makes_way_for_a_waiting_one),
		TEST(restriction_ends_and_doubles_when_repeated),
		TEST(both_scenes_are_accepted_afterwards),
		TEST(scene_waits_for_a_thread_that_has_yet_to_stop),
		TEST(leaving_worker_builds_no_scene),
		TEST(lack_of_memory_is_no_jobs_fault),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
