/* SPDX-License-Identifier: Apache-2.0 */
/* A supervisor whose worker processes end as planned: after which ends another process is started, and the
 * supervisor's exit code. Each supervisor runs in a process of its own. */
#include "worker/daemon/supervise.h"

#include <errno.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

enum { STARTS_MAX = 8, BY_SIGNAL = 1000, NEVER = -1 };

/* The test's plan, in memory shared with the processes. */
static struct {
	int planned_ends[STARTS_MAX]; /* by start: an exit code, BY_SIGNAL + a signal, or NEVER */
	atomic_int start_count;
	atomic_int fork_count, remaining_fork_failures; /* the supervisor's forks; after the first, this many fail */
	int hang_up_process; /* number of the process that sends SIGHUP to the supervisor; 0: none */
	bool counts_forks;   /* set in the supervisor */
} * plan;

pid_t __real_fork(void);
pid_t __wrap_fork(void);
pid_t __wrap_fork(void)
{
	if (plan->counts_forks && atomic_fetch_add(&plan->fork_count, 1) > 0 &&
	    atomic_fetch_sub(&plan->remaining_fork_failures, 1) > 0) {
		errno = EAGAIN;
		return -1;
	}
	return __real_fork();
}

static int run_child(void *user)
{
	(void)user;
	int start = atomic_fetch_add(&plan->start_count, 1), end = start < STARTS_MAX ? plan->planned_ends[start] : 99;
	if (plan->hang_up_process == start + 1)
		kill(getppid(), SIGHUP); /* delivered before this process ends: SIGCHLD has a higher number */
	while (end == NEVER)
		pause();
	if (end >= BY_SIGNAL)
		kill(getpid(), end - BY_SIGNAL);
	return end;
}

/* Returns the exit code of a supervisor started with this disposition of SIGHUP. */
static int supervise_code(void (*hang_up)(int))
{
	int status;
	atomic_store(&plan->start_count, 0);
	atomic_store(&plan->fork_count, 0);
	pid_t p = __real_fork();
	assert_true(p >= 0);
	if (p == 0) {
		signal(SIGHUP, hang_up);
		plan->counts_forks = true;
		_exit(supervise_process(1, run_child, NULL));
	}
	assert_int_equal(waitpid(p, &status, 0), p);
	plan->counts_forks = false;
	assert_true(WIFEXITED(status));
	return WEXITSTATUS(status);
}

/* Whatever exit code the process with this number returns is the program's exit code, and no further process is
 * started. */
static void expect_last_process(int process, const int *codes, size_t count)
{
	for (size_t i = 0; i < count; i++) {
		plan->planned_ends[process] = codes[i];
		assert_int_equal(supervise_code(SIG_DFL), codes[i]);
		assert_int_equal(plan->start_count, process + 1);
	}
}

static void exit_of_the_first_process_is_final(void **state)
{
	(void)state;
	expect_last_process(0, (const int[]){0, 1, 2, 6, 75}, 5);
}

static void failed_restart_is_repeated(void **state)
{
	(void)state;
	plan->planned_ends[0] = BY_SIGNAL + SIGKILL;
	plan->planned_ends[1] = 1;
	plan->planned_ends[2] = 2;
	expect_last_process(3, (const int[]){0, 6, 75}, 3);
}

static void failed_fork_is_repeated(void **state)
{
	(void)state;
	plan->planned_ends[0] = BY_SIGNAL + SIGKILL;
	plan->planned_ends[1] = 6;
	atomic_store(&plan->remaining_fork_failures, 2);
	assert_int_equal(supervise_code(SIG_DFL), 6);
	assert_int_equal(plan->start_count, 2);
	assert_int_equal(plan->fork_count, 4);
}

/* SIGHUP is ignored as under nohup, when the terminal closes. */
static void ignored_hang_up_stays_ignored(void **state)
{
	(void)state;
	plan->hang_up_process = 1;
	plan->planned_ends[0] = BY_SIGNAL + SIGKILL;
	plan->planned_ends[1] = 6;
	assert_int_equal(supervise_code(SIG_IGN), 6);
	assert_int_equal(plan->start_count, 2);
	plan->planned_ends[0] = NEVER; /* SIGHUP ends the process, to which it is passed on */
	assert_int_equal(supervise_code(SIG_DFL), 0);
	assert_int_equal(plan->start_count, 1);
	plan->hang_up_process = 0;
}

int main(void)
{
	plan = mmap(NULL, sizeof *plan, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	if (plan == MAP_FAILED)
		return 1;
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(exit_of_the_first_process_is_final),
		cmocka_unit_test(failed_restart_is_repeated),
		cmocka_unit_test(failed_fork_is_repeated),
		cmocka_unit_test(ignored_hang_up_stays_ignored),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
