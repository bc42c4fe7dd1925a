/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Any allocation of the coordinator may fail: while a result is merged, while an image is made, and while the
 * coordinator starts. The job goes on, at the latest when the coordinator starts again.
 */
#include "common/base/mem.h"
#include "coordinator/jobs/publish.h"
#include "coordinator/server/server.h"
#include "tests/support/failing_memory.h"
#include "tests/support/folder.h"
#include "tests/support/staged.h"

#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

static void without_memory_for_a_result(void **state)
{
	(void)state;
	enum { TRIES = 6 };
	unsigned ends = 0;
	for (unsigned i = 0; i < TRIES; i++) {
		staged_disk->allocations = i;
		staged_start();
		uint64_t job = staged_submit();
		staged_disk->fail_memory = true;
		if (!staged_work_on()) {
			ends++;
			staged_end(SIGKILL, false);
			staged_start();
			assert_true(staged_work_on());
		}
		staged_await_state(job, "done");
		assert_false(staged_disk->fail_memory);
		staged_end(SIGTERM, true);
	}
	assert_true(ends > 0);
}

/* An image that could not be made for lack of memory is made later, whatever it is needed for; the job goes on. */
static void no_memory_for_an_image(void **state)
{
	(void)state;
	uint64_t id = staged_begin_a_job();
	struct server *s = staged_open_here();
	assert_non_null(s);
	struct live_job *job = jobs_find(&s->jobs, id);
	assert_true(job && job->canvas);
	for (enum publish_what what = PUBLISH_ERROR_ONLY; what <= PUBLISH_RESULT; what++) {
		mem_fail_after(0);
		publish_start(&s->jobs, job, what, live_job_rounds(job));
		mem_fail_after(-1);
		assert_true(job->busy && STAILQ_EMPTY(&s->jobs.deferred));
		while (job->busy || (what == PUBLISH_RESULT && !job->record.has_result))
			uv_run(&s->loop, UV_RUN_ONCE);
		struct job_status status;
		assert_true(farm_job(s->jobs.farm, id, jobs_now(&s->jobs), &status) && status.state == JOB_RUNNING);
	}
	server_close(s);
}

/* Returns whether the planned failure of an allocation has happened. */
static bool has_failed(void)
{
	void *p = mem_alloc(1, 1);
	for (int i = 0; i < 1000 && p; i++, p = mem_alloc(1, 1))
		mem_free(p);
	mem_free(p);
	mem_fail_after(-1);
	return p != NULL;
}

static bool opens_without(long allocation)
{
	struct job_counts counts;
	mem_fail_after(allocation);
	struct server *s = staged_open_here();
	bool failed = has_failed();
	assert_true(s || failed);
	if (s) {
		assert_true(s->jobs.live && s->jobs.live->canvas &&
			    farm_counts(s->jobs.farm, s->jobs.live->id, &counts));
		server_close(s);
	}
	return failed;
}

/* The coordinator starts with all its jobs or not at all. */
static void no_memory_for_a_start(void **state)
{
	(void)state;
	staged_begin_a_job();
	long n = 0;
	while (opens_without(n))
		n++;
	print_message("   %ld allocations\n", n);
	assert_true(n > 50);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(without_memory_for_a_result, staged_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(no_memory_for_an_image, staged_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(no_memory_for_a_start, staged_set_up, folder_tear_down),
	};
	log_set_level(LOG_LEVEL_ERROR);
	return staged_open() ? 1 : cmocka_run_group_tests(tests, NULL, NULL);
}
