/* SPDX-License-Identifier: Apache-2.0 */
/* XML that Mitsuba 3 reads although the standard forbids it: the corrected text, byte by byte; valid XML stays
 * unchanged. */
#include "common/base/mem.h"
#include "worker/render/xml/xml_tidy.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

static void expect_tidied(const char *text, const char *wanted)
{
	size_t size = strlen(text);
	char *got = xml_tidy(text, &size);
	assert_non_null(got);
	assert_int_equal(size, strlen(wanted));
	assert_memory_equal(got, wanted, size);
	mem_free(got);
}

static void expect_unchanged(const char *text)
{
	expect_tidied(text, text);
}

static void test_comments_are_tidied(void **state)
{
	(void)state;
	expect_tidied("<a><!-- b -- c\n--- d --></a>", "<a>           \n         </a>");
	expect_tidied("<!----- Camera -----><a/>", "                     <a/>");
	expect_tidied("<!--->--><a/><!-- -->", "         <a/>        ");
	expect_unchanged("<a/><!-- no end -- ");
	expect_unchanged("<a/><!-- no end <!-- either");
}

static void test_bare_ampersands_are_escaped(void **state)
{
	(void)state;
	expect_tidied("<a b='c & d'/>", "<a b='c &amp; d'/>");
	expect_tidied("<a b='&c;&'/>", "<a b='&amp;c;&amp;'/>");
	expect_unchanged("<a b='&amp;&lt;&gt;&quot;&apos;&#65;&#x41;'/>");
	expect_unchanged("<a><![CDATA[ & <!-- -- -->]]></a><?pi & ?>");
}

static void test_misplaced_declarations_are_tidied(void **state)
{
	(void)state;
	expect_unchanged("<?xml version='1.0' encoding='ISO-8859-1'?><a/>");
	expect_unchanged("\xef\xbb\xbf<?xml version='1.0'?><a/>");
	expect_tidied("\n <?xml version='1.0'?>\n<a/>", "\n                      \n<a/>");
	expect_tidied("<!-- x --><?xml version='1.0'?><a/>", "                               <a/>");
	expect_unchanged("<a/><?xml version='1.0'?>");
	expect_unchanged("\n<?xml version='1.0'");
}

static void test_empty_wide_and_endless_texts_are_handled(void **state)
{
	(void)state;
	size_t size = 0;
	char *none = xml_tidy(NULL, &size);
	assert_non_null(none);
	assert_int_equal(size, 0);
	mem_free(none);
	static const char wide[] = "<\0&\0", big[] = "\xfe\xff\0&";
	size = 4;
	char *same = xml_tidy(wide, &size);
	assert_true(same && size == 4 && memcmp(same, wide, 4) == 0);
	mem_free(same);
	same = xml_tidy(big, &size);
	assert_true(same && size == 4 && memcmp(same, big, 4) == 0);
	mem_free(same);
	/* For markup without an end, the search for this end must not be repeated for each occurrence. */
	enum { MANY = 1 << 20 };
	size = MANY * sizeof wide;
	char *endless = mem_alloc(size, 1);
	assert_non_null(endless);
	for (size_t i = 0; i < size; i++)
		endless[i] = "<!--"[i % 4];
	char *copy = xml_tidy(endless, &size);
	assert_true(copy && memcmp(copy, endless, size) == 0);
	mem_free(copy);
	mem_free(endless);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_comments_are_tidied),
		cmocka_unit_test(test_bare_ampersands_are_escaped),
		cmocka_unit_test(test_misplaced_declarations_are_tidied),
		cmocka_unit_test(test_empty_wide_and_endless_texts_are_handled),
	};
	return cmocka_run_group_tests_name("xml_tidy", tests, NULL, NULL);
}
