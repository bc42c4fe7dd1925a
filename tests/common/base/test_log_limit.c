/* SPDX-License-Identifier: Apache-2.0 */
/* A burst of log lines is cut off, counted and reported; occasional lines pass. */
#include "common/base/log_limit.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

static unsigned count_logged_lines(struct log_bucket *b, unsigned lines, double from, double to)
{
	unsigned n = 0;
	for (unsigned i = 0; i < lines; i++)
		n += log_bucket_take(b, from + (to - from) * i / lines);
	return n;
}

static void burst_of_lines_is_cut(void **state)
{
	(void)state;
	struct log_bucket b = {0};
	assert_int_equal(count_logged_lines(&b, 4000, 1000, 1000), LOG_BURST);
	assert_int_equal(log_bucket_take_withheld(&b, 1000), 0); /* the burst may go on */
	assert_int_equal(log_bucket_take_withheld(&b, 1000.5), 4000 - LOG_BURST);
	assert_int_equal(log_bucket_take_withheld(&b, 1100), 0); /* reported once */
	/* 4,000 lines in ten seconds, from an empty bucket: those pass for which the bucket is refilled meanwhile. */
	assert_int_equal(count_logged_lines(&b, LOG_BURST, 2000, 2000), LOG_BURST);
	assert_in_range(count_logged_lines(&b, 4000, 2000, 2010), 10 * LOG_PER_SECOND - 1, 10 * LOG_PER_SECOND);
}

static void occasional_lines_pass(void **state)
{
	(void)state;
	struct log_bucket b = {0};
	assert_int_equal(count_logged_lines(&b, 10000, 5, 5 + 10000.0 / LOG_PER_SECOND), 10000);
	assert_int_equal(log_bucket_take_withheld(&b, 1e6), 0);
}

/* The monotonic clock does not go back; if a caller's clock did, its bucket would only fill later. */
static void clock_going_back_adds_no_lines(void **state)
{
	(void)state;
	struct log_bucket b = {0};
	assert_int_equal(count_logged_lines(&b, LOG_BURST + 1, 50, 50), LOG_BURST);
	assert_false(log_bucket_take(&b, 40));
	assert_true(log_bucket_take(&b, 50 + 1.0 / LOG_PER_SECOND));
	assert_int_equal(log_bucket_take_withheld(&b, 60), 2);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(burst_of_lines_is_cut),
					   cmocka_unit_test(occasional_lines_pass),
					   cmocka_unit_test(clock_going_back_adds_no_lines)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
