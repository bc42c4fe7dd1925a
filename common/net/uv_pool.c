/* SPDX-License-Identifier: Apache-2.0 */
/*
 * First creates as many threads as the pool will have, all at the same time, and ends them. Then the pool can create
 * its own: the C library keeps the stacks of threads that have ended and gives them to new ones.
 *
 * Failures: if a thread cannot be created, those before it end, and the pool is not touched.
 */
#include "common/net/uv_pool.h"

#include <stdlib.h>
#include <string.h>

enum { POOL_SIZE_DEFAULT = 4, POOL_SIZE_MAX = 1024 }; /* libuv's default and maximum */

static unsigned pool_size(void)
{
	const char *text = getenv("UV_THREADPOOL_SIZE");
	long n = text ? strtol(text, NULL, 10) : POOL_SIZE_DEFAULT;
	return n < 1 ? 1 : n > POOL_SIZE_MAX ? POOL_SIZE_MAX : (unsigned)n;
}

static void wait_at_gate(void *gate)
{
	uv_sem_wait(gate);
}

static int try_threads(unsigned count)
{
	uv_thread_t threads[POOL_SIZE_MAX];
	uv_sem_t gate;
	unsigned started = 0;
	int rc = uv_sem_init(&gate, 0);
	if (rc)
		return rc;
	while (!rc && started < count) {
		rc = uv_thread_create(&threads[started], wait_at_gate, &gate);
		started += !rc;
	}
	for (unsigned i = 0; i < started; i++)
		uv_sem_post(&gate);
	for (unsigned i = 0; i < started; i++)
		uv_thread_join(&threads[i]);
	uv_sem_destroy(&gate);
	return rc;
}

static void run_empty_task(uv_work_t *work)
{
	(void)work;
}

int uv_pool_start(uv_loop_t *loop, struct error *e)
{
	uv_work_t first;
	unsigned count = pool_size();
	int rc = try_threads(count);
	if (rc == UV_EAGAIN || rc == UV_ENOMEM) /* the system's answer to both kinds of limits is EAGAIN */
		return error_set(e, ENOMEM, "no memory for %u threads, or too many threads (ulimit -v, ulimit -u)",
				 count);
	if (!rc)
		rc = uv_queue_work(loop, &first, run_empty_task, NULL);
	if (rc)
		return error_set(e, -rc, "no threads: %s", uv_strerror(rc));
	uv_run(loop, UV_RUN_DEFAULT);
	return 0;
}
