/* SPDX-License-Identifier: Apache-2.0 */
/* What program.h promises to main once its options have been read. */
#include "common/base/program.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

static const struct option_row rows[] = {{0}};
static const struct program empty_program = {.name = "nothing",
					     .summary = "Does nothing.",
					     .options = {(const struct option_group[]){{NULL, rows}, {0}}, NULL}};

/* Returns the exit code of `run` in a process of its own, or 128 plus the signal that ended it. */
static int exit_code_of(int (*run)(void))
{
	int status;
	pid_t child = fork();
	assert_true(child >= 0);
	if (child == 0) {
		char name[] = "nothing", *argv[] = {name, NULL};
		program_parse_options(&empty_program, 1, argv, NULL);
		_exit(run());
	}
	assert_int_equal(waitpid(child, &status, 0), child);
	return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

static int write_past_file_size_limit(void)
{
	static const struct rlimit limit = {1000, RLIM_INFINITY};
	static const char bytes[2000];
	FILE *f = tmpfile();
	if (!f || setrlimit(RLIMIT_FSIZE, &limit))
		return 1;
	if (write(fileno(f), bytes, sizeof bytes) != 1000)
		return 2;
	return write(fileno(f), bytes, sizeof bytes) == -1 && errno == EFBIG ? 0 : 3;
}

static void file_size_limit_is_an_error_and_no_signal(void **state)
{
	(void)state;
	assert_int_equal(exit_code_of(write_past_file_size_limit), 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(file_size_limit_is_an_error_and_no_signal)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
