/* SPDX-License-Identifier: Apache-2.0 */
/* Classes of paths against an independent form of their definition, over all words of smooth and rough vertices. */
#include "common/film/path_class.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

/* The class from the word itself: camera first, one letter per vertex, 's' smooth or 'r' rough. */
static enum path_class_kind kind_by_definition(const char *word)
{
	size_t n = strlen(word), first_rough = strcspn(word, "r"), smooth = 0;
	for (size_t i = 0; i < n; i++)
		smooth += word[i] == 's';
	if (smooth == 0)
		return PATH_ROUGH;
	if (smooth == n)
		return PATH_SMOOTH;
	if (first_rough == 0)
		return PATH_CAUSTIC;
	return smooth == first_rough ? PATH_REFLECTED : PATH_REFLECTED_CAUSTIC;
}

static void test_every_word_has_its_defined_class(void **state)
{
	(void)state;
	for (unsigned n = 0; n <= 10; n++)
		for (unsigned bits = 0; bits < 1u << n; bits++) {
			char word[16] = "";
			enum path_class_kind kind = PATH_NO_VERTEX;
			for (unsigned i = 0; i < n; i++) {
				bool smooth = bits >> i & 1;
				word[i] = smooth ? 's' : 'r';
				kind = path_class_kind_next(kind, smooth);
			}
			if (kind == PATH_NO_VERTEX)
				kind = PATH_ROUGH;
			assert_int_equal(kind, kind_by_definition(word));
			assert_int_equal(path_class(n + 1, kind) / PATH_CLASS_LENGTHS, kind);
		}
	assert_int_equal(path_class(1, PATH_NO_VERTEX), path_class(1, PATH_ROUGH));
}

static enum path_class_kind kind_of_bits(unsigned bits, unsigned n)
{
	enum path_class_kind kind = PATH_NO_VERTEX;
	for (unsigned i = 0; i < n; i++)
		kind = path_class_kind_next(kind, bits >> i & 1);
	return kind;
}

/* A word joined from two parts, each of any length. */
static void test_joined_parts_have_the_class_of_the_whole_word(void **state)
{
	(void)state;
	for (unsigned n = 0; n <= 8; n++)
		for (unsigned bits = 0; bits < 1u << n; bits++)
			for (unsigned cut = 0; cut <= n; cut++)
				assert_int_equal(path_class_kind_join(kind_of_bits(bits, cut),
								      kind_of_bits(bits >> cut, n - cut)),
						 kind_of_bits(bits, n));
}

static void test_classes_have_ranges_of_lengths_and_distinct_names(void **state)
{
	(void)state;
	for (unsigned edges = 1; edges <= 128; edges++) {
		unsigned length = edges > 8 ? 3 : edges > 4 ? 2 : edges > 2 ? 1 : 0;
		for (enum path_class_kind k = 0; k < PATH_CLASS_KINDS; k++)
			assert_int_equal(path_class(edges, k), (unsigned)k * PATH_CLASS_LENGTHS + length);
	}
	assert_string_equal(path_class_name(path_class(3, PATH_CAUSTIC)), "caustic, 3-4 edges");
	assert_string_equal(path_class_name(path_class(40, PATH_REFLECTED_CAUSTIC)),
			    "reflected caustic, 9 edges and more");
	for (unsigned a = 0; a < PATH_CLASSES; a++)
		for (unsigned b = 0; b < a; b++)
			assert_string_not_equal(path_class_name(a), path_class_name(b));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_every_word_has_its_defined_class),
		cmocka_unit_test(test_joined_parts_have_the_class_of_the_whole_word),
		cmocka_unit_test(test_classes_have_ranges_of_lengths_and_distinct_names),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
