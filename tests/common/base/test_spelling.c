/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/spelling.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

static const char *nearest_name(const char *wanted)
{
	static const char *const names[] = {"roughdielectric", "dielectric", "diffuse", "conductor", "roughconductor"};
	static struct spelling s;
	s = (struct spelling){.wanted_name = wanted};
	for (size_t i = 0; i < sizeof names / sizeof *names; i++)
		spelling_offer(&s, names[i]);
	return s.best_match ? s.best_match : "";
}

static void test_misspelled_names_are_corrected(void **state)
{
	(void)state;
	assert_string_equal(nearest_name("difuse"), "diffuse");
	assert_string_equal(nearest_name("dielectirc"), "dielectric");
	assert_string_equal(nearest_name("roughConductor"), "roughconductor");
	assert_string_equal(nearest_name("rough_dielectric"), "roughdielectric");
	assert_string_equal(nearest_name("subsurface"), "");
	assert_string_equal(nearest_name(""), "");
}

/* An offered name need not stay valid after the call: names in a folder listing do not. */
static void test_offered_names_are_copied(void **state)
{
	(void)state;
	char name[] = "room.xml";
	struct spelling s = {.wanted_name = "rom.xml"};
	spelling_offer(&s, name);
	memset(name, 'x', sizeof name - 1);
	spelling_offer(&s, name);
	assert_string_equal(s.best_match, "room.xml");
}

static void test_full_list_ends_in_an_ellipsis(void **state)
{
	(void)state;
	char list[24] = "";
	spelling_append_to_list(list, sizeof list, "path");
	spelling_append_to_list(list, sizeof list, "bdpt");
	assert_string_equal(list, "path, bdpt");
	spelling_append_to_list(list, sizeof list, "a longer name");
	spelling_append_to_list(list, sizeof list, "x");
	assert_string_equal(list, "path, bdpt, ...");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_misspelled_names_are_corrected),
		cmocka_unit_test(test_offered_names_are_copied),
		cmocka_unit_test(test_full_list_ends_in_an_ellipsis),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
