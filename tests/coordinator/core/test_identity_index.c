/* SPDX-License-Identifier: Apache-2.0 */
/* Checks the index against a linear search of the same list, and the length of its chains. */
#include "coordinator/core/identity_index.h"

#include "common/base/mem.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { ENTRIES = 400, STEPS = 20000 };

struct indexed_list {
	struct identity_index index;
	struct identity entries[ENTRIES];
	bool is_used[ENTRIES];
	uint64_t last_id;
};

static struct identity *find_linearly(struct indexed_list *b, enum identity_key by, uint64_t id,
				      const char *certificate, const char *text)
{
	struct identity *found = NULL;
	for (int i = 0; i < ENTRIES; i++) {
		struct identity *k = &b->entries[i];
		if (!b->is_used[i] || (by == IDENTITY_BY_ID ? k->id != id : strcmp(k->certificate, certificate) != 0))
			continue;
		if (by == IDENTITY_BY_ID || strcmp(by == IDENTITY_BY_HOME ? k->home : k->name, text) == 0)
			found = k; /* the last match */
	}
	return found;
}

/* Few names, so that many entries share one; and one entry's certificate and name joined may equal those of another,
 * joined. */
static void add_entry(struct indexed_list *b, uint32_t i)
{
	struct identity *k = &b->entries[i];
	*k = (struct identity){.registry_index = i, .id = ++b->last_id};
	snprintf(k->certificate, sizeof k->certificate, "%.*s", rand() % 3, "ab");
	snprintf(k->name, sizeof k->name, "%s%d", rand() % 2 ? "b" : "", rand() % 40);
	snprintf(k->home, sizeof k->home, "%llu", (unsigned long long)b->last_id); /* no two homes are equal */
	identity_index_add(&b->index, k);
	b->is_used[i] = true;
}

static void index_agrees_with_a_linear_search(void **state)
{
	(void)state;
	struct indexed_list *b = mem_alloc(1, sizeof *b);
	assert_non_null(b);
	assert_int_equal(identity_index_init(&b->index, 64), 0);
	srand(1);
	for (int step = 0; step < STEPS; step++) {
		uint32_t i = (uint32_t)rand() % ENTRIES;
		struct identity *k = &b->entries[i];
		if (b->is_used[i]) {
			identity_index_remove(&b->index, k);
			b->is_used[i] = false;
		} else {
			add_entry(b, i);
		}
		const struct identity *like = &b->entries[rand() % ENTRIES]; /* present, removed, or never added */
		if (!like->id)
			continue;
		assert_ptr_equal(identity_index_find_by_id(&b->index, like->id),
				 find_linearly(b, IDENTITY_BY_ID, like->id, NULL, NULL));
		assert_ptr_equal(identity_index_find_by_home(&b->index, like->certificate, like->home),
				 find_linearly(b, IDENTITY_BY_HOME, 0, like->certificate, like->home));
		assert_ptr_equal(identity_index_find_by_name(&b->index, like->certificate, like->name),
				 find_linearly(b, IDENTITY_BY_NAME, 0, like->certificate, like->name));
	}
	identity_index_fini(&b->index);
	mem_free(b);
}

/* After a restart each group and part of each job is looked up. */
static void hash_chains_are_short(void **state)
{
	(void)state;
	enum {
		MANY = 16384,
		LONGEST = 12
	}; /* with as many random entries, a chain is longer than 10 in 1 of 1e5 runs */
	struct identity_index x;
	struct identity *all = mem_alloc(MANY, sizeof *all);
	assert_non_null(all);
	assert_int_equal(identity_index_init(&x, MANY), 0);
	for (uint32_t i = 0; i < MANY; i++) {
		struct identity *k = &all[i];
		k->id = i + 1;
		snprintf(k->certificate, sizeof k->certificate, "workers");
		snprintf(k->name, sizeof k->name, "node%u.cluster", i);
		snprintf(k->home, sizeof k->home, "%032x", i);
		identity_index_add(&x, k);
	}
	for (int by = 0; by < IDENTITY_KEY_COUNT; by++)
		for (uint32_t i = 0; i < MANY; i++) {
			int length = 0;
			for (const struct identity *k = x.bucket_heads[by][i]; k; k = k->next[by])
				length++;
			assert_true(length <= LONGEST);
		}
	identity_index_fini(&x);
	mem_free(all);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(index_agrees_with_a_linear_search),
		cmocka_unit_test(hash_chains_are_short),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
