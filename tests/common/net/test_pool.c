/* SPDX-License-Identifier: Apache-2.0 */
/* Either libuv's thread pool starts, or the attempt leaves nothing behind. uv_thread_create is wrapped (Makefile) so
 * that it can fail here. */
#include "common/net/uv_pool.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static int created_count, allowed_count; /* threads created in a test, and those before the first that is refused */

int __real_uv_thread_create(uv_thread_t *thread, uv_thread_cb run, void *arg);
int __wrap_uv_thread_create(uv_thread_t *thread, uv_thread_cb run, void *arg);
int __wrap_uv_thread_create(uv_thread_t *thread, uv_thread_cb run, void *arg)
{
	int rc = created_count < allowed_count ? __real_uv_thread_create(thread, run, arg) : UV_EAGAIN;
	created_count += !rc;
	return rc;
}

static int count_process_threads(void)
{
	char line[256];
	int n = 0;
	FILE *f = fopen("/proc/self/status", "r");
	assert_non_null(f);
	while (fgets(line, sizeof line, f))
		if (strncmp(line, "Threads:", 8) == 0)
			n = atoi(line + 8);
	fclose(f);
	return n;
}

static int start_pool(int allowed, struct error *e)
{
	uv_loop_t loop;
	created_count = 0;
	allowed_count = allowed;
	assert_int_equal(uv_loop_init(&loop), 0);
	int rc = uv_pool_start(&loop, e);
	assert_int_equal(uv_loop_close(&loop), 0);
	return rc;
}

/* libuv would abort if the system refused one of its threads: so its pool is not started at all. */
static void refused_thread_fails_the_start(void **state)
{
	struct error e;
	(void)state;
	int before = count_process_threads();
	for (int allowed = 0; allowed < 4; allowed++) {
		assert_int_equal(start_pool(allowed, &e), -ENOMEM);
		assert_non_null(strstr(e.text, "memory"));
		assert_int_equal(created_count, allowed);
		assert_int_equal(count_process_threads(), before);
	}
}

static void all_threads_of_the_pool_start(void **state)
{
	struct error e;
	(void)state;
	int before = count_process_threads();
	assert_int_equal(start_pool(4, &e), 0);
	assert_int_equal(created_count, 4);
	assert_int_equal(count_process_threads(), before + 4); /* the threads of the pool, before its first use */
	assert_int_equal(start_pool(4, &e), 0);
	assert_int_equal(count_process_threads(), before + 4);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(refused_thread_fails_the_start),
					   cmocka_unit_test(all_threads_of_the_pool_start)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
