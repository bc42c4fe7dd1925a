/* SPDX-License-Identifier: Apache-2.0 */
/* An invalid operation of the program's own code ends the program, or control returns to the catch point; one inside
 * a library does neither. Checked in child processes by their exit signals. */
#include "worker/render/math/fptrap.h"

#include <math.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

static volatile double zero, result;

static void invalid(void)
{
	result = zero / zero;
}

static void ours_seen_on_entering_a_library(void)
{
	fptrap_watch();
	invalid();
	fptrap_leave_library(fptrap_enter_library());
	_exit(0);
}

static void ours_seen_at_the_end(void)
{
	bool before = fptrap_watch();
	fptrap_leave_library(fptrap_enter_library());
	invalid();
	fptrap_unwatch(before);
}

static void in_a_library(void)
{
	bool before = fptrap_watch();
	unsigned left = fptrap_enter_library();
	invalid();
	fptrap_leave_library(left);
	fptrap_leave_library(fptrap_enter_library());
	fptrap_unwatch(before);
}

static void not_watched(void)
{
	invalid();
	fptrap_leave_library(fptrap_enter_library());
	fptrap_unwatch(fptrap_watch());
}

/* Returns the signal that ends a child running f, or 0. */
static int signal_of(void (*f)(void))
{
	pid_t child = fork();
	assert_true(child >= 0);
	if (child == 0) {
		signal(SIGFPE, SIG_DFL);
		f();
		_exit(0);
	}
	int status;
	assert_int_equal(waitpid(child, &status, 0), child);
	return WIFSIGNALED(status) ? WTERMSIG(status) : 0;
}

static void test_signals(void **state)
{
	(void)state;
#if defined(__x86_64__)
	assert_int_equal(signal_of(ours_seen_on_entering_a_library), SIGFPE);
	assert_int_equal(signal_of(ours_seen_at_the_end), SIGFPE);
#endif
	assert_int_equal(signal_of(in_a_library), 0);
	assert_int_equal(signal_of(not_watched), 0);
}

/* Returns whether f ends at the catch point. */
static bool is_caught(void (*f)(void))
{
	jmp_buf back;
	if (setjmp(back))
		return true;
	jmp_buf *before = fptrap_catch(&back);
	assert_null(before);
	f();
	fptrap_catch(NULL);
	return false;
}

static void ours_within_the_watch(void)
{
	bool before = fptrap_watch();
	invalid();
	fptrap_unwatch(before);
}

static void test_caught(void **state)
{
	(void)state;
#if defined(__x86_64__)
	assert_true(is_caught(ours_within_the_watch));
	assert_true(is_caught(ours_seen_at_the_end));
	assert_null(fptrap_catch(NULL)); /* once only: the next invalid operation raises a signal again */
	assert_int_equal(signal_of(ours_within_the_watch), SIGFPE);
#endif
	assert_false(is_caught(in_a_library));
	assert_false(is_caught(not_watched));
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_signals), cmocka_unit_test(test_caught)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
