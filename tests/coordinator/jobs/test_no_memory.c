/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Any allocation of the coordinator may fail: while a result is merged, while an image is made, and while the
 * coordinator starts. The job goes on, at the latest when the coordinator starts again.
 */
#include "common/base/mem.h"
#include "coordinator/jobs/publish.h"
#include "coordinator/server/server.h"
#include "tests/support/failing_memory.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/staged_server.h"

#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

static void lack_of_memory_for_a_result_loses_nothing(void **state)
{
	(void)state;
	enum { TRIES = 6 };
	unsigned ends = 0;
	for (unsigned i = 0; i < TRIES; i++) {
		staged_disk->allocations_before_failure = i;
		staged_server_start();
		uint64_t job = staged_server_submit();
		staged_disk->fail_allocation = true;
		if (!staged_server_work_to_end()) {
			ends++;
			staged_server_end(SIGKILL, false);
			staged_server_start();
			assert_true(staged_server_work_to_end());
		}
		staged_server_await_state(job, "done");
		assert_false(staged_disk->fail_allocation);
		staged_server_end(SIGTERM, true);
	}
	assert_true(ends > 0);
}

/* An image that could not be made for lack of memory is made later, whatever it is needed for; the job goes on. */
static void image_without_memory_is_made_later(void **state)
{
	(void)state;
	uint64_t id = staged_server_begin_job();
	struct server *s = staged_server_open_in_process();
	assert_non_null(s);
	struct live_job *job = jobs_find_live(&s->jobs, id);
	assert_true(job && job->canvas);
	for (enum publish_kind what = PUBLISH_ERROR_ONLY; what <= PUBLISH_RESULT; what++) {
		mem_fail_after(0);
		publish_start(&s->jobs, job, what, live_job_complete_rounds(job));
		mem_fail_after(-1);
		assert_true(job->is_busy && STAILQ_EMPTY(&s->jobs.deferred_events));
		while (job->is_busy || (what == PUBLISH_RESULT && !job->record.has_result))
			uv_run(&s->loop, UV_RUN_ONCE);
		struct job_status status;
		assert_true(farm_job_status(s->jobs.farm, id, jobs_now(&s->jobs), &status) &&
			    status.state == JOB_RUNNING);
	}
	server_close(s);
}

/* Returns whether the planned failure of an allocation has happened. */
static bool allocation_has_failed(void)
{
	void *p = mem_alloc(1, 1);
	for (int i = 0; i < 1000 && p; i++, p = mem_alloc(1, 1))
		mem_free(p);
	mem_free(p);
	mem_fail_after(-1);
	return p != NULL;
}

static bool try_start_without(long allocation)
{
	struct job_counts counts;
	mem_fail_after(allocation);
	struct server *s = staged_server_open_in_process();
	bool failed = allocation_has_failed();
	assert_true(s || failed);
	if (s) {
		assert_true(s->jobs.live_jobs && s->jobs.live_jobs->canvas &&
			    farm_job_counts(s->jobs.farm, s->jobs.live_jobs->id, &counts));
		server_close(s);
	}
	return failed;
}

/* The coordinator starts with all its jobs or not at all. */
static void start_has_all_jobs_or_fails(void **state)
{
	(void)state;
	staged_server_begin_job();
	long n = 0;
	while (try_start_without(n))
		n++;
	print_message("   %ld allocations\n", n);
	assert_true(n > 50);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(lack_of_memory_for_a_result_loses_nothing, staged_server_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(image_without_memory_is_made_later, staged_server_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(start_has_all_jobs_or_fails, staged_server_set_up,
						temporary_folder_tear_down),
	};
	log_set_level(LOG_LEVEL_ERROR);
	return staged_server_map_disk() ? 1 : cmocka_run_group_tests(tests, NULL, NULL);
}
