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
static char said[4096];
static FILE *file;
static int kept;

static void begin(void)
{
	file = tmpfile();
	assert_non_null(file);
	fflush(stderr);
	kept = dup(STDERR_FILENO);
	assert_true(kept >= 0 && dup2(fileno(file), STDERR_FILENO) >= 0);
}

static void end(void)
{
	fflush(stderr);
	assert_true(dup2(kept, STDERR_FILENO) >= 0);
	close(kept);
	rewind(file);
	said[fread(said, 1, sizeof said - 1, file)] = 0;
	fclose(file);
}

static void test_lines(void **state)
{
	(void)state;
	struct progress p;
	begin();
	progress_start(&p);
	progress_show(&p, 0, "running", "a");
	progress_show(&p, 0, "running", "b");
	progress_show(&p, 0.05, "running", "c");
	progress_show(&p, 0.11, "running", "d");
	p.shown_time -= 30;
	progress_show(&p, 0.11, "running", "e");
	p.shown_time -= 30;
	progress_show(&p, 0.11, "running", "f");
	progress_show(&p, 0.11, "running", "g");
	progress_end(&p);
	end();
	assert_string_equal(said, "running 0.0 % a\nrunning 11.0 % d\nrunning 11.0 % f\n");
}

static void test_never_back(void **state)
{
	(void)state;
	struct progress p;
	progress_start(&p);
	assert_true(progress_kept(&p, 0.4, "bootstrap") == 0.4);
	assert_true(progress_kept(&p, 0.1, "running") == 0.1); /* of another state or job */
	assert_true(progress_kept(&p, 0.6, "running") == 0.6);
	assert_true(progress_kept(&p, 0.3, "running") == 0.6); /* the job takes longer than was estimated */
	assert_true(progress_kept(&p, 0, "running") == 0.6);   /* no estimate is known any more */
	assert_true(progress_kept(&p, 0.7, "running") == 0.7);
}

static void test_why_it_fell(void **state)
{
	(void)state;
	struct progress p;
	char detail[64] = "round 7", small[12] = "round 7";
	progress_start(&p);
	progress_explain_fall(&p, 0.4, "bootstrap", detail, sizeof detail);
	progress_explain_fall(&p, 0.2, "running", detail, sizeof detail);
	progress_explain_fall(&p, 0.8, "running", detail, sizeof detail);
	progress_explain_fall(&p, 0.7999, "running", detail, sizeof detail); /* the displayed number is the same */
	assert_string_equal(detail, "round 7");
	progress_explain_fall(&p, 0.5, "running", small, sizeof small);
	assert_string_equal(small, "round 7; it");
	progress_explain_fall(&p, 0.5, "running", detail, sizeof detail);
	assert_string_equal(detail, "round 7; it was at 80.0 %, and more is to be done now");
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_lines), cmocka_unit_test(test_never_back),
					   cmocka_unit_test(test_why_it_fell)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
