/* SPDX-License-Identifier: Apache-2.0 */
/* Arenas: arena_intern() returns the same copy for equal bytes, and the limit of the arena applies to these copies as
 * well. */
#include "common/base/arena.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

enum { SIZE = 4096 };

static void test_equal_bytes_are_shared(void **state)
{
	(void)state;
	struct arena a = {0};
	static unsigned char bytes[SIZE], other[SIZE];
	const struct arena_interned *first = arena_intern(&a, bytes, SIZE), *none = arena_intern(&a, bytes, 0);
	assert_true(first && none && first != none && none->size == 0);
	size_t used = a.used;
	for (int i = 0; i < 1000; i++)
		assert_ptr_equal(arena_intern(&a, other, SIZE), first);
	assert_int_equal(a.used, used);
	/* Bytes between the hashed ones count as well; so does the size. */
	for (size_t i = 0; i < 5; i++) {
		other[150 + i] = 1;
		const struct arena_interned *s = arena_intern(&a, other, SIZE);
		assert_true(s && s != first && memcmp(s->bytes, other, SIZE) == 0);
		assert_ptr_equal(arena_intern(&a, other, SIZE), s);
	}
	assert_ptr_not_equal(arena_intern(&a, bytes, SIZE - 1), first);
	assert_ptr_equal(arena_intern(&a, bytes, SIZE), first);
	bytes[0] = 1; /* it is a copy */
	assert_int_equal(((const unsigned char *)first->bytes)[0], 0);
	arena_fini(&a);
}

static void test_copies_keep_their_user_pointers(void **state)
{
	(void)state;
	struct arena a = {0};
	enum { MANY = 5000 };
	static struct arena_interned *all[MANY];
	for (int round = 0; round < 2; round++)
		for (uint32_t i = 0; i < MANY; i++) {
			struct arena_interned *s = arena_intern(&a, &i, sizeof i);
			assert_non_null(s);
			assert_true(round == 0 ? s->user == NULL : s == all[i] && s->user == &all[i]);
			all[i] = s;
			s->user = &all[i];
		}
	arena_fini(&a);
}

/* A table that gave up after a few entries of other hashes would copy an unlucky one for each use. */
static void test_crowded_table_finds_every_copy(void **state)
{
	(void)state;
	struct arena a = {0};
	enum { MANY = 20000, NUMBERS = 64 };
	static struct arena_interned *all[MANY];
	for (int round = 0; round < 2; round++) {
		uint64_t x = 1;
		for (size_t i = 0; i < MANY; i++) {
			uint64_t numbers[NUMBERS];
			for (size_t k = 0; k < NUMBERS; k++)
				numbers[k] = x = x * 6364136223846793005u + 1442695040888963407u;
			struct arena_interned *s = arena_intern(&a, numbers, sizeof numbers);
			assert_non_null(s);
			assert_true(round == 0 || s == all[i]);
			all[i] = s;
		}
	}
	arena_fini(&a);
}

/* Of 34 numbers the last but one is not part of the hash. 120,000 such copies took 7 s when each passed all others. */
static void test_equal_hashes_do_not_slow_lookups(void **state)
{
	(void)state;
	struct arena a = {0};
	double numbers[34] = {0};
	clock_t begun = clock();
	for (int i = 0; i < 120000; i++) {
		numbers[32] = i;
		struct arena_interned *s = arena_intern(&a, numbers, sizeof numbers);
		assert_non_null(s);
		assert_memory_equal(s->bytes, numbers, sizeof numbers);
	}
	assert_true(clock() - begun < 3 * CLOCKS_PER_SEC);
	numbers[32] = 0;
	assert_ptr_equal(arena_intern(&a, numbers, sizeof numbers), arena_intern(&a, numbers, sizeof numbers));
	arena_fini(&a);
}

static void test_copies_respect_the_limit_of_the_arena(void **state)
{
	(void)state;
	struct arena a = {.limit = 64 << 10};
	static unsigned char bytes[SIZE];
	uint32_t copy_count = 0;
	for (uint32_t i = 0; i < 100; i++) {
		memcpy(bytes, &i, sizeof i);
		copy_count += arena_intern(&a, bytes, SIZE) != NULL;
	}
	assert_in_range(copy_count, 10, 16);
	memset(bytes, 0, sizeof bytes);
	assert_non_null(arena_intern(&a, bytes, SIZE));
	assert_true(a.used <= a.limit);
	arena_fini(&a);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_equal_bytes_are_shared),
		cmocka_unit_test(test_copies_keep_their_user_pointers),
		cmocka_unit_test(test_crowded_table_finds_every_copy),
		cmocka_unit_test(test_equal_hashes_do_not_slow_lookups),
		cmocka_unit_test(test_copies_respect_the_limit_of_the_arena),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
