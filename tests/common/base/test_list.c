/* SPDX-License-Identifier: Apache-2.0 */
/* Arrays grow, keep their contents, and stay valid when memory runs out. */
#include "common/base/list.h"

#include "common/base/mem.h"
#include "tests/support/failing_memory.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static uint64_t *push_value(uint64_t *items, size_t *count, uint64_t value)
{
	uint64_t *more = list_grow_array(items, *count, sizeof *more);
	assert_non_null(more);
	more[(*count)++] = value;
	return more;
}

/* Also after items were removed: the count may be below that for which memory was last allocated. */
static void array_grows_after_items_were_removed(void **state)
{
	(void)state;
	for (size_t peak_count = 0; peak_count < 70; peak_count++)
		for (size_t reduced_count = 0; reduced_count <= peak_count; reduced_count++) {
			uint64_t *items = NULL;
			size_t count = 0;
			while (count < peak_count)
				items = push_value(items, &count, count);
			count = reduced_count;
			while (count < peak_count + 3)
				items = push_value(items, &count, count);
			for (size_t i = 0; i < count; i++)
				assert_int_equal(items[i], i);
			mem_free(items);
		}
}

static void array_survives_lack_of_memory(void **state)
{
	(void)state;
	uint64_t *items = NULL;
	size_t count = 0;
	while (count < 4)
		items = push_value(items, &count, count);
	mem_fail_after(0);
	assert_null(list_grow_array(items, count, sizeof *items));
	assert_ptr_equal(list_grow_array(items, 3, sizeof *items), items);
	mem_fail_after(-1);
	for (size_t i = 0; i < count; i++)
		assert_int_equal(items[i], i);
	mem_free(items);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(array_grows_after_items_were_removed),
					   cmocka_unit_test(array_survives_lack_of_memory)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
