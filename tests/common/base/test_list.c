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

static uint64_t *push(uint64_t *items, size_t *count, uint64_t value)
{
	uint64_t *more = list_room(items, *count, sizeof *more);
	assert_non_null(more);
	more[(*count)++] = value;
	return more;
}

/* Also after items were removed: the count may be below that for which memory was last allocated. */
static void room_follows_the_count(void **state)
{
	(void)state;
	for (size_t most = 0; most < 70; most++)
		for (size_t rest = 0; rest <= most; rest++) {
			uint64_t *items = NULL;
			size_t count = 0;
			while (count < most)
				items = push(items, &count, count);
			count = rest;
			while (count < most + 3)
				items = push(items, &count, count);
			for (size_t i = 0; i < count; i++)
				assert_int_equal(items[i], i);
			mem_free(items);
		}
}

static void memory_is_out(void **state)
{
	(void)state;
	uint64_t *items = NULL;
	size_t count = 0;
	while (count < 4)
		items = push(items, &count, count);
	mem_fail_after(0);
	assert_null(list_room(items, count, sizeof *items));
	assert_ptr_equal(list_room(items, 3, sizeof *items), items);
	mem_fail_after(-1);
	for (size_t i = 0; i < count; i++)
		assert_int_equal(items[i], i);
	mem_free(items);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(room_follows_the_count), cmocka_unit_test(memory_is_out)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
