/* SPDX-License-Identifier: Apache-2.0 */
/* The observed time that passed does not follow a wall clock that jumps. */
#include "coordinator/store/age_clock.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <errno.h>
#include <stdio.h>
#include <string.h>

#define DAY 86400.0

static double age_after(const char *boot, double up, double wall)
{
	struct age_clock last = {.observed_seconds = 1000, .uptime = 500, .wall_time = 100 * DAY, .boot_id = "first"},
			 now = {.uptime = up, .wall_time = wall};
	snprintf(now.boot_id, sizeof now.boot_id, "%s", boot);
	age_clock_advance(&now, &last, AGE_CLOCK_CREDIT_MAX);
	return now.observed_seconds;
}

static void age_ignores_jumps_of_the_wall_clock(void **state)
{
	(void)state;
	struct age_clock first = {.observed_seconds = 7, .uptime = 1, .wall_time = 2};
	age_clock_advance(&first, NULL, AGE_CLOCK_CREDIT_MAX);
	assert_true(first.observed_seconds == 0);
	assert_true(age_after("first", 600, 140 * DAY) == 1100); /* 40 days ahead */
	assert_true(age_after("first", 600, 0) == 1100);
	assert_true(age_after("first", 400, 100 * DAY) == 1000); /* no machine's clock behaves like that */
	assert_true(age_after("second", 10, 100 * DAY + 300) == 1300);
	assert_true(age_after("second", 10, 140 * DAY) == 1000 + AGE_CLOCK_CREDIT_MAX);
	assert_true(age_after("second", 10, 0) == 1000);
	assert_true(age_after("", 600, 100 * DAY + 60) == 1060); /* a system without a boot id */
}

/* The credit is a part of the retention time, however short that is. */
static void credit_is_a_part_of_the_retention_time(void **state)
{
	(void)state;
	assert_true(age_clock_max_credit(0) == AGE_CLOCK_CREDIT_MAX &&
		    age_clock_max_credit(30 * DAY) == AGE_CLOCK_CREDIT_MAX);
	assert_true(age_clock_max_credit(300 * DAY) == AGE_CLOCK_CREDIT_MAX);
	assert_true(age_clock_max_credit(3 * DAY) == DAY / 10 && age_clock_max_credit(60) == 2);
}

static void clock_survives_text_and_damage_is_detected(void **state)
{
	(void)state;
	struct age_clock s = {.observed_seconds = 12345.678, .uptime = 99.5, .wall_time = 1.7e9, .boot_id = "f3a1-22"},
			 back;
	char text[AGE_CLOCK_TEXT_MAX];
	size_t size = age_clock_to_text(&s, text);
	assert_int_equal(age_clock_from_text(text, size, &back), 0);
	assert_true(back.observed_seconds == s.observed_seconds && back.uptime == s.uptime &&
		    back.wall_time == s.wall_time);
	assert_string_equal(back.boot_id, s.boot_id);
	for (size_t i = 0; i + 1 < size; i++)
		for (int bit = 0; bit < 8; bit++) {
			text[i] = (char)(text[i] ^ 1 << bit);
			int rc = age_clock_from_text(text, size, &back);
			assert_true(
				rc == -EBADMSG ||
				(rc == 0 && back.observed_seconds ==
						    s.observed_seconds)); /* a hexadecimal digit in the other case */
			text[i] = (char)(text[i] ^ 1 << bit);
		}
	for (size_t n = 0; n + 1 < size; n++)
		assert_int_equal(age_clock_from_text(text, n, &back), -EBADMSG);
	assert_int_equal(age_clock_from_text(text, AGE_CLOCK_TEXT_MAX, &back), -EBADMSG);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(age_ignores_jumps_of_the_wall_clock),
		cmocka_unit_test(credit_is_a_part_of_the_retention_time),
		cmocka_unit_test(clock_survives_text_and_damage_is_detected),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
