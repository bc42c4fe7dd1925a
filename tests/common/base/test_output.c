/* SPDX-License-Identifier: Apache-2.0 */
/* A program whose stdout is a full disk fails instead of reporting success. */
#include "common/base/program.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

static const struct program program = {.name = "ends", .summary = "Ends.", .exits = "0 done"};
static char name[] = "ends", *argv[] = {name, NULL};

/* Returns the exit code of a process that prints so many lines to `path`. */
static int exit_code_of(const char *path, size_t lines, bool flush, int code)
{
	int status = -1;
	fflush(NULL);
	pid_t pid = fork();
	if (pid == 0) {
		if (!freopen(path, "w", stdout) || !freopen("/dev/null", "w", stderr))
			_exit(99);
		program_options(&program, 1, argv, NULL);
		for (size_t i = 0; i < lines; i++)
			puts("j1");
		if (flush)
			fflush(stdout);
		exit(code);
	}
	assert_int_equal(waitpid(pid, &status, 0), pid);
	assert_true(WIFEXITED(status));
	return WEXITSTATUS(status);
}

static void a_full_disk_is_noticed(void **state)
{
	(void)state;
	for (int flush = 0; flush < 2; flush++) {
		assert_int_equal(exit_code_of("/dev/full", 1, flush, 0), 1);
		assert_int_equal(exit_code_of("/dev/full", 100000, flush, 0), 1); /* more than the buffer holds */
		assert_int_equal(exit_code_of("/dev/full", 1, flush, 75), 75);
		assert_int_equal(exit_code_of("/dev/full", 0, flush, 0), 0);
		assert_int_equal(exit_code_of("/dev/null", 100000, flush, 0), 0);
		assert_int_equal(exit_code_of("/dev/null", 1, flush, 6), 6);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(a_full_disk_is_noticed)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
