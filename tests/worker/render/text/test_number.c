/* SPDX-License-Identifier: Apache-2.0 */
/* Numbers in texts: accepted and refused notations, rounding against strtod(), lists of numbers, and snake case. */
#include "worker/render/math/rng.h"
#include "worker/render/text/number.h"
#include "worker/render/text/snake_case.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void test_valid_numbers_are_parsed(void **state)
{
	(void)state;
	static const struct {
		const char *text;
		double value;
	} good[] = {{"1", 1},
		    {" -2.5 ", -2.5},
		    {".73", .73},
		    {"0.5f", .5},
		    {" 100F ", 100},
		    {"5.", 5},
		    {"+1e3", 1000},
		    {"-4.37114e-008", -4.37114e-8},
		    {"1e-320", 1e-320},
		    {"123456789012345678901234567890", 123456789012345678901234567890.0},
		    {"0.1", 0.1},
		    {"1.7976931348623157e308", 1.7976931348623157e308},
		    {"1e-999", 0},
		    {"0e99999999", 0},
		    {"9007199254740993", 9007199254740993.0}};
	for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
		double x = -1;
		if (!number_parse(good[i].text, &x) || x != good[i].value)
			fail_msg("%s gave %.17g", good[i].text, x);
	}
}

static void test_invalid_numbers_are_refused(void **state)
{
	(void)state;
	static const char *const bad[] = {"",	 " ",	"nan", "inf", "-inf", "0x10", "1,5", "1e",  "1e400",
					  "--1", "1 2", ".",   "-",   "e5",   "1ff",  "f",   "1 f", "1d"};
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
		double x;
		if (number_parse(bad[i], &x))
			fail_msg("%s was taken for %g", bad[i], x);
	}
	int64_t n;
	assert_false(number_parse_int("1.5", &n));
	assert_false(number_parse_int("99999999999999999999", &n));
	assert_true(number_parse_int(" -12 ", &n));
	assert_int_equal(n, -12);
}

static void test_rounding_agrees_with_strtod(void **state)
{
	(void)state;
	for (uint64_t i = 0; i < 20000; i++) {
		double u[4], x = 0;
		rng_uniform4(0x6e756d, RNG_TEST, i, 0, 0, u);
		char text[64];
		snprintf(text, sizeof text, "%.*ge%d", 1 + (int)(u[0] * 18), u[1] - 0.5, (int)(u[2] * 80) - 40);
		if (strchr(text, 'e') != strrchr(text, 'e'))
			continue;
		if (!number_parse(text, &x) || x != strtod(text, NULL))
			fail_msg("%s gave %.17g", text, x);
	}
}

static void test_lists_of_numbers_are_parsed(void **state)
{
	(void)state;
	double v[3];
	assert_int_equal(number_parse_list("1, 2, 3", v, 3), 3);
	assert_true(v[0] == 1 && v[1] == 2 && v[2] == 3);
	assert_int_equal(number_parse_list(".8,.8,.8", v, 3), 3);
	assert_int_equal(number_parse_list(" 1420 1552\n1642 ", v, 3), 3);
	assert_int_equal(number_parse_list("1f, 2.f 3e0F", v, 3), 3);
	assert_true(v[0] == 1 && v[1] == 2 && v[2] == 3);
	assert_int_equal(number_parse_list("1f2", v, 3), -1);
	assert_int_equal(number_parse_list("", v, 3), 0);
	assert_int_equal(number_parse_list("1 2 3 4", v, 3), -1);
	assert_int_equal(number_parse_list("1,,2", v, 3), 2);
	assert_int_equal(number_parse_list(", 1 ,2, ", v, 3), 2);
	assert_int_equal(number_parse_list(" , ", v, 3), 0);
	assert_int_equal(number_parse_list("1;2", v, 3), -1);
	assert_int_equal(number_parse_list("1-2", v, 3), -1);
	assert_int_equal(number_parse_weights("0.5; .25,,0.125f ;", v, 3), 3);
	assert_true(v[0] == 0.5 && v[1] == 0.25 && v[2] == 0.125);
	assert_int_equal(number_parse_weights(" ,", v, 3), 0);
	assert_int_equal(number_parse_weights("1 2 3 4", v, 3), -1);
	assert_int_equal(number_parse_weights("1-2", v, 3), -1);
	assert_int_equal(number_parse_weights("1;x", v, 3), -1);
}

static void check_snake_case(const char *from, const char *to)
{
	char out[128];
	snake_case_from_camel(from, out);
	assert_string_equal(out, to);
}

static void test_names_become_snake_case(void **state)
{
	(void)state;
	check_snake_case("toWorld", "to_world");
	check_snake_case("intIOR", "int_ior");
	check_snake_case("maxDepth", "max_depth");
	check_snake_case("extEta", "ext_eta");
	check_snake_case("uvscale", "uvscale");
	check_snake_case("flipTexCoords", "flip_tex_coords");
	check_snake_case("int_ior", "int_ior");
	check_snake_case("", "");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_valid_numbers_are_parsed),    cmocka_unit_test(test_invalid_numbers_are_refused),
		cmocka_unit_test(test_rounding_agrees_with_strtod), cmocka_unit_test(test_lists_of_numbers_are_parsed),
		cmocka_unit_test(test_names_become_snake_case),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
