/* SPDX-License-Identifier: Apache-2.0 */
/* The server accepts as many connections as it has file descriptors for, and refuses more with a reason. */
#include "coordinator/server/limits.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <sys/resource.h>
#include <cmocka.h>

static void set_file_limit(rlim_t soft, rlim_t hard)
{
	struct rlimit r = {soft, hard};
	assert_int_equal(setrlimit(RLIMIT_NOFILE, &r), 0);
}

static rlim_t soft_file_limit(void)
{
	struct rlimit r;
	assert_int_equal(getrlimit(RLIMIT_NOFILE, &r), 0);
	return r.rlim_cur;
}

static void file_descriptors_limit_connections(void **state)
{
	(void)state;
	struct error e;
	unsigned n = 0;
	set_file_limit(64, 2048);
	assert_int_equal(limits_reserve_connections(100, &n, &e), 0);
	assert_int_equal(n, 100);
	assert_true(soft_file_limit() >= 100 + 3 * 256 && soft_file_limit() < 2048); /* no more descriptors than needed:
										      * a job has three */
	assert_int_equal(limits_reserve_connections(2000, &n, &e), -EINVAL);
	assert_non_null(strstr(
		e.text, "2000 connections, and 256 jobs, need 3024 file descriptors, and this process may have 2048"));
	assert_int_equal(limits_reserve_connections(0, &n, &e), 0);
	assert_int_equal(n, 2048 - 1024);
	assert_int_equal(soft_file_limit(), 2048);
	set_file_limit(64, 1030); /* jobs and fetches could take almost all of them */
	assert_int_equal(limits_reserve_connections(0, &n, &e), -EINVAL);
	assert_non_null(strstr(e.text, "16 connections, and 256 jobs, need 1040 file descriptors"));
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(file_descriptors_limit_connections)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
