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

static const struct program program = {.name = "ends", .summary = "Ends.", .exit_codes = "0 done"};
static char program_name[] = "ends", *argv[] = {program_name, NULL};

/* Returns the exit code of a process that prints so many lines to `path`. */
static int exit_code_after_printing(const char *path, size_t lines, bool flush, int code)
{
	int status = -1;
	fflush(NULL);
	pid_t pid = fork();
	if (pid == 0) {
		if (!freopen(path, "w", stdout) || !freopen("/dev/null", "w", stderr))
			_exit(99);
		program_parse_options(&program, 1, argv, NULL);
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

static void full_disk_behind_stdout_is_an_error(void **state)
{
	(void)state;
	for (int flush = 0; flush < 2; flush++) {
		assert_int_equal(exit_code_after_printing("/dev/full", 1, flush, 0), 1);
		/* More than the buffer holds. */
		assert_int_equal(exit_code_after_printing("/dev/full", 100000, flush, 0), 1);
		assert_int_equal(exit_code_after_printing("/dev/full", 1, flush, 75), 75);
		assert_int_equal(exit_code_after_printing("/dev/full", 0, flush, 0), 0);
		assert_int_equal(exit_code_after_printing("/dev/null", 100000, flush, 0), 0);
		assert_int_equal(exit_code_after_printing("/dev/null", 1, flush, 6), 6);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(full_disk_behind_stdout_is_an_error)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
