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

static void perform_invalid_operation(void)
{
	result = zero / zero;
}

static void invalid_before_a_library(void)
{
	fptrap_watch();
	perform_invalid_operation();
	fptrap_leave_library(fptrap_enter_library());
	_exit(0);
}

static void invalid_before_the_watch_ends(void)
{
	bool was_watching = fptrap_watch();
	fptrap_leave_library(fptrap_enter_library());
	perform_invalid_operation();
	fptrap_unwatch(was_watching);
}

static void invalid_within_a_library(void)
{
	bool was_watching = fptrap_watch();
	unsigned left = fptrap_enter_library();
	perform_invalid_operation();
	fptrap_leave_library(left);
	fptrap_leave_library(fptrap_enter_library());
	fptrap_unwatch(was_watching);
}

static void invalid_while_unwatched(void)
{
	perform_invalid_operation();
	fptrap_leave_library(fptrap_enter_library());
	fptrap_unwatch(fptrap_watch());
}

/* Returns the signal that ends a child running f, or 0. */
static int signal_of_child(void (*f)(void))
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

static void invalid_operation_of_our_code_ends_the_program(void **state)
{
	(void)state;
#if defined(__x86_64__)
	assert_int_equal(signal_of_child(invalid_before_a_library), SIGFPE);
	assert_int_equal(signal_of_child(invalid_before_the_watch_ends), SIGFPE);
#endif
	assert_int_equal(signal_of_child(invalid_within_a_library), 0);
	assert_int_equal(signal_of_child(invalid_while_unwatched), 0);
}

/* Returns whether f ends at the catch point. */
static bool is_caught(void (*f)(void))
{
	jmp_buf catch_point;
	if (setjmp(catch_point))
		return true;
	jmp_buf *outer_catch_point = fptrap_catch(&catch_point);
	assert_null(outer_catch_point);
	f();
	fptrap_catch(NULL);
	return false;
}

static void invalid_within_the_watch(void)
{
	bool was_watching = fptrap_watch();
	perform_invalid_operation();
	fptrap_unwatch(was_watching);
}

static void invalid_operation_returns_to_the_catch_point(void **state)
{
	(void)state;
#if defined(__x86_64__)
	assert_true(is_caught(invalid_within_the_watch));
	assert_true(is_caught(invalid_before_the_watch_ends));
	assert_null(fptrap_catch(NULL)); /* once only: the next invalid operation raises a signal again */
	assert_int_equal(signal_of_child(invalid_within_the_watch), SIGFPE);
#endif
	assert_false(is_caught(invalid_within_a_library));
	assert_false(is_caught(invalid_while_unwatched));
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(invalid_operation_of_our_code_ends_the_program),
					   cmocka_unit_test(invalid_operation_returns_to_the_catch_point)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
