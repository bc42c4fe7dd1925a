/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The table by which shapes find their BSDF: what is in it is found, what is not is not, and the work of a look-up does
 * not grow with the number of BSDFs. Counted, not timed. A scene with one BSDF a shape has as many as shapes.
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

enum { NODES = 20000, STRIDE = 96 }; /* bytes from one node to the next, as an arena hands them out */

static char nodes[NODES * STRIDE], meshes[NODES * STRIDE];

/* Entries looked at to add `count` nodes and to find each once. */
static uint64_t work_of(uint32_t count)
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
	uint64_t r = t.compared;
	arena_fini(&arena);
	return r;
}

/*
 * Three look-ups a node. With addresses hashed well and half of the table free the expected number of entries is 2.5
 * where nothing is found and 1.5 else (Knuth, volume 3, section 6.4), 6.5 in all while the table is fullest; a walk
 * over all is count / 2.
 */
static void test_work(void **state)
{
	(void)state;
	assert_true(work_of(200) < 10 * 200);
	assert_true(work_of(NODES) < 10 * NODES);
}

static void test_by_mesh(void **state)
{
	(void)state;
	struct arena arena = {0};
	struct node_table t;
	uint32_t k;
	assert_int_equal(node_table_init(&t, 2 * 1000 + 2, &arena), 0);
	/* A node of all meshes, one of each mesh, and no node at all. */
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

static void test_out_of_memory(void **state)
{
	(void)state;
	struct arena arena = {.limit = 1024};
	struct node_table t;
	assert_int_equal(node_table_init(&t, 1000, &arena), -ENOMEM);
	arena_fini(&arena);
}

static void test_one_each(void **state)
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
	struct world *w = world_of_text(8, 8, SENSOR("0,0,9", "0,0,0") "<emitter type='constant'/>%s%s",
					"<bsdf type='diffuse' id='both'/>", text);
	free(text);
	assert_int_equal(w->shape_count, SHAPES);
	/* A third with one each, one more for those that share and for those that have none, and one that the world has
	 * for what no path meets. */
	assert_in_range(w->bsdf_count, SHAPES / 3 + 2, SHAPES / 3 + 3);
	for (uint32_t i = 3; i < SHAPES; i++)
		assert_true((w->parts[i].bsdf == w->parts[i - 3].bsdf) == (i % 3 != 0));
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_work),
		cmocka_unit_test(test_by_mesh),
		cmocka_unit_test(test_out_of_memory),
		cmocka_unit_test(test_one_each),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
