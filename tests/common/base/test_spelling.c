/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/spelling.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

static const char *nearest(const char *wanted)
{
	static const char *const names[] = {"roughdielectric", "dielectric", "diffuse", "conductor", "roughconductor"};
	static struct spelling s;
	s = (struct spelling){.wanted = wanted};
	for (size_t i = 0; i < sizeof names / sizeof *names; i++)
		spelling_offer(&s, names[i]);
	return s.best ? s.best : "";
}

static void test_nearest(void **state)
{
	(void)state;
	assert_string_equal(nearest("difuse"), "diffuse");
	assert_string_equal(nearest("dielectirc"), "dielectric");
	assert_string_equal(nearest("roughConductor"), "roughconductor");
	assert_string_equal(nearest("rough_dielectric"), "roughdielectric");
	assert_string_equal(nearest("subsurface"), "");
	assert_string_equal(nearest(""), "");
}

/* An offered name need not stay valid after the call: names in a folder listing do not. */
static void test_copy(void **state)
{
	(void)state;
	char name[] = "room.xml";
	struct spelling s = {.wanted = "rom.xml"};
	spelling_offer(&s, name);
	memset(name, 'x', sizeof name - 1);
	spelling_offer(&s, name);
	assert_string_equal(s.best, "room.xml");
}

static void test_list(void **state)
{
	(void)state;
	char list[24] = "";
	spelling_list(list, sizeof list, "path");
	spelling_list(list, sizeof list, "bdpt");
	assert_string_equal(list, "path, bdpt");
	spelling_list(list, sizeof list, "a longer name");
	spelling_list(list, sizeof list, "x");
	assert_string_equal(list, "path, bdpt, ...");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_nearest),
		cmocka_unit_test(test_copy),
		cmocka_unit_test(test_list),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
