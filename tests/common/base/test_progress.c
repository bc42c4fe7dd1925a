/* SPDX-License-Identifier: Apache-2.0 */
/* Lines of progress without a terminal: one for each tenth, and one a minute even if nothing changes. A displayed
 * estimate of progress does not fall. */
#include "common/base/progress.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <stdio.h>
#include <string.h>
#include <unistd.h>

/* Text written to stderr between begin and end. */
static char captured_text[4096];
static FILE *capture_file;
static int saved_stderr;

static void capture_begin(void)
{
	capture_file = tmpfile();
	assert_non_null(capture_file);
	fflush(stderr);
	saved_stderr = dup(STDERR_FILENO);
	assert_true(saved_stderr >= 0 && dup2(fileno(capture_file), STDERR_FILENO) >= 0);
}

static void capture_end(void)
{
	fflush(stderr);
	assert_true(dup2(saved_stderr, STDERR_FILENO) >= 0);
	close(saved_stderr);
	rewind(capture_file);
	captured_text[fread(captured_text, 1, sizeof captured_text - 1, capture_file)] = 0;
	fclose(capture_file);
}

static void test_lines_appear_each_tenth_and_each_minute(void **state)
{
	(void)state;
	struct progress p;
	capture_begin();
	progress_begin(&p);
	progress_show(&p, 0, "running", "a");
	progress_show(&p, 0, "running", "b");
	progress_show(&p, 0.05, "running", "c");
	progress_show(&p, 0.11, "running", "d");
	p.printed_time -= 30;
	progress_show(&p, 0.11, "running", "e");
	p.printed_time -= 30;
	progress_show(&p, 0.11, "running", "f");
	progress_show(&p, 0.11, "running", "g");
	progress_end(&p);
	capture_end();
	assert_string_equal(captured_text, "running 0.0 % a\nrunning 11.0 % d\nrunning 11.0 % f\n");
}

static void test_progress_never_falls_within_a_state(void **state)
{
	(void)state;
	struct progress p;
	progress_begin(&p);
	assert_true(progress_max_fraction(&p, 0.4, "bootstrap") == 0.4);
	assert_true(progress_max_fraction(&p, 0.1, "running") == 0.1); /* of another state or job */
	assert_true(progress_max_fraction(&p, 0.6, "running") == 0.6);
	assert_true(progress_max_fraction(&p, 0.3, "running") == 0.6); /* the job takes longer than was estimated */
	assert_true(progress_max_fraction(&p, 0, "running") == 0.6);   /* no estimate is known any more */
	assert_true(progress_max_fraction(&p, 0.7, "running") == 0.7);
}

static void test_fall_of_progress_is_explained(void **state)
{
	(void)state;
	struct progress p;
	char detail[64] = "round 7", small[12] = "round 7";
	progress_begin(&p);
	progress_explain_decrease(&p, 0.4, "bootstrap", detail, sizeof detail);
	progress_explain_decrease(&p, 0.2, "running", detail, sizeof detail);
	progress_explain_decrease(&p, 0.8, "running", detail, sizeof detail);
	progress_explain_decrease(&p, 0.7999, "running", detail, sizeof detail); /* the displayed number is the same */
	assert_string_equal(detail, "round 7");
	progress_explain_decrease(&p, 0.5, "running", small, sizeof small);
	assert_string_equal(small, "round 7; it");
	progress_explain_decrease(&p, 0.5, "running", detail, sizeof detail);
	assert_string_equal(detail, "round 7; it was at 80.0 %, and more is to be done now");
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_lines_appear_each_tenth_and_each_minute),
					   cmocka_unit_test(test_progress_never_falls_within_a_state),
					   cmocka_unit_test(test_fall_of_progress_is_explained)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
