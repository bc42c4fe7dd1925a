/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The table in which shapes look up their BSDF: entries are found, absent keys are not, and the work of a look-up
 * does not grow with the number of BSDFs. The probes are counted, not timed. In a scene with one BSDF per shape, the
 * table has as many entries as there are shapes.
 */
#include "worker/render/world/node_table.h"
#include "tests/support/worlds.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { NODES = 20000, STRIDE = 96 }; /* bytes from one node to the next, as in an arena */

static char nodes[NODES * STRIDE], meshes[NODES * STRIDE];

/* Returns the number of entries probed to add `count` nodes and to find each once. */
static uint64_t count_probes(uint32_t count)
{
	struct arena arena = {0};
	struct node_table t;
	uint32_t k;
	assert_int_equal(node_table_init(&t, count, &arena), 0);
	for (uint32_t i = 0; i < count; i++) {
		assert_false(node_table_find(&t, &nodes[i * STRIDE], NULL, &k));
		node_table_add(&t, &nodes[i * STRIDE], NULL, i);
	}
	for (uint32_t i = 0; i < count; i++)
		assert_true(node_table_find(&t, &nodes[i * STRIDE], NULL, &k) && k == i);
	assert_int_equal(t.count, count);
	uint64_t r = t.probe_count;
	arena_fini(&arena);
	return r;
}

/*
 * Three look-ups per node. With well-hashed addresses and half of the table free, the expected number of probes is
 * 2.5 for an unsuccessful search and 1.5 for a successful one (Knuth, volume 3, section 6.4), 6.5 in all when the
 * table is fullest; a linear search would need count / 2.
 */
static void test_few_entries_are_probed(void **state)
{
	(void)state;
	assert_true(count_probes(200) < 10 * 200);
	assert_true(count_probes(NODES) < 10 * NODES);
}

static void test_nodes_are_found_by_mesh(void **state)
{
	(void)state;
	struct arena arena = {0};
	struct node_table t;
	uint32_t k;
	assert_int_equal(node_table_init(&t, 2 * 1000 + 2, &arena), 0);
	/* A third of the meshes refers to one shared node, a third has a node each, and a third has none. */
	for (uint32_t i = 0; i < 1000; i++) {
		node_table_add(&t, &nodes[0], &meshes[i * STRIDE], i);
		node_table_add(&t, &nodes[STRIDE], &meshes[i * STRIDE], 1000 + i);
	}
	node_table_add(&t, &nodes[2 * STRIDE], NULL, 2000);
	node_table_add(&t, NULL, NULL, 2001);
	for (uint32_t i = 0; i < 1000; i++) {
		assert_true(node_table_find(&t, &nodes[0], &meshes[i * STRIDE], &k) && k == i);
		assert_true(node_table_find(&t, &nodes[STRIDE], &meshes[i * STRIDE], &k) && k == 1000 + i);
		assert_false(node_table_find(&t, &nodes[2 * STRIDE], &meshes[i * STRIDE], &k));
	}
	assert_false(node_table_find(&t, &nodes[0], NULL, &k));
	assert_true(node_table_find(&t, &nodes[2 * STRIDE], NULL, &k) && k == 2000);
	assert_true(node_table_find(&t, NULL, NULL, &k) && k == 2001);
	arena_fini(&arena);
}

static void test_failed_allocations_are_reported(void **state)
{
	(void)state;
	struct arena arena = {.limit = 1024};
	struct node_table t;
	assert_int_equal(node_table_init(&t, 1000, &arena), -ENOMEM);
	arena_fini(&arena);
}

static void test_each_node_is_added_once(void **state)
{
	(void)state;
	enum { SHAPES = 300 };
	char *text = malloc(SHAPES * 160), *at = text;
	assert_non_null(text);
	for (int i = 0; i < SHAPES; i++)
		at += sprintf(
			at,
			"<shape type='sphere'><point name='center' x='%d' y='0' z='0'/><float name='radius' value='0.1'/>%s"
			"</shape>",
			i,
			i % 3 == 2 ? "<ref id='both'/>"
			: i % 3	   ? ""
				   : "<bsdf type='diffuse'/>");
	struct world *w = world_from_text(8, 8, SENSOR("0,0,9", "0,0,0") "<emitter type='constant'/>%s%s",
					  "<bsdf type='diffuse' id='both'/>", text);
	free(text);
	assert_int_equal(w->shape_count, SHAPES);
	/* One BSDF for each mesh of one third, one for all that share, one for all that have none, and possibly one
	 * for surfaces that no path meets. */
	assert_in_range(w->bsdf_count, SHAPES / 3 + 2, SHAPES / 3 + 3);
	for (uint32_t i = 3; i < SHAPES; i++)
		assert_true((w->shape_bindings[i].bsdf == w->shape_bindings[i - 3].bsdf) == (i % 3 != 0));
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_few_entries_are_probed),
		cmocka_unit_test(test_nodes_are_found_by_mesh),
		cmocka_unit_test(test_failed_allocations_are_reported),
		cmocka_unit_test(test_each_node_is_added_once),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
