/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The bytes that wait to be sent to many peers are bounded: peers that hold much and have read nothing for longest give
 * way.
 */
#include "common/net/send_pool.h"

#include <stdarg.h>
#include <setjmp.h>
#include <cmocka.h>

#include <string.h>

enum { PEERS = 5 };

static struct send_pool pool;
static struct peer {
	struct send_share share;
	uint64_t left;
} peers[PEERS];
static char gave_way[16];

static uint64_t left_of(const struct send_share *s)
{
	return ((const struct peer *)s)->left;
}

static void note_giving_way(struct send_share *s)
{
	size_t n = strlen(gave_way);
	gave_way[n] = (char)('a' + ((struct peer *)s - peers));
	gave_way[n + 1] = 0;
}

static int begin(void **state)
{
	(void)state;
	pool = (struct send_pool){.limit = 100};
	memset(peers, 0, sizeof peers);
	memset(gave_way, 0, sizeof gave_way);
	for (int i = 0; i < PEERS; i++)
		peers[i].share = (struct send_share){.pool = &pool, .left = left_of, .give_way = note_giving_way};
	return 0;
}

/* All memory is given back in the end, whichever peers gave way. */
static int end(void **state)
{
	(void)state;
	for (int i = 0; i < PEERS; i++) {
		send_pool_leave(&peers[i].share);
		send_pool_sub(&peers[i].share, peers[i].share.bytes, 0);
	}
	return pool.used || pool.leaving || !LIST_EMPTY(&pool.waiting);
}

static bool send(int i, uint64_t bytes, uint64_t now)
{
	bool ok = send_pool_add(&peers[i].share, bytes, now);
	peers[i].left += ok ? bytes : 0;
	send_pool_look(&peers[i].share, now);
	return ok;
}

/* The kernel takes a part of what waits, without reporting it. */
static void reads_some(int i)
{
	peers[i].left--;
}

static void whoever_has_read_nothing_for_longest(void **state)
{
	(void)state;
	assert_true(send(0, 30, 1) && send(1, 30, 2) && send(2, 30, 3));
	assert_true(send(3, 30, 4));
	assert_string_equal(gave_way, "a");
	assert_true(pool.used == 90 && pool.leaving == 30);
	reads_some(1);
	assert_true(send(3, 20, 5)); /* the second peer has just read */
	assert_string_equal(gave_way, "ac");
	send_pool_sub(&peers[0].share, 30, 6);
	assert_int_equal(pool.leaving, 30);
	assert_int_equal(pool.used, 80);
	/* the last peer holds most, and has read nothing since it was first sent something */
	assert_false(send(3, 40, 6));
	assert_string_equal(gave_way, "acd");
	assert_int_equal(pool.used, 30);
}

static void little_is_left_alone(void **state)
{
	(void)state;
	assert_true(send(0, 5, 1) && send(1, 60, 2) && send(2, 5, 3) && send(3, 25, 4));
	assert_true(send(4, 10, 5));
	assert_string_equal(gave_way, "b");
	assert_true(send(4, 70, 6)); /* on average the peers hold 11: this one holds less, and the fourth more */
	assert_string_equal(gave_way, "bd");
}

static void of_the_same_moment_the_most(void **state)
{
	(void)state;
	assert_true(send(0, 30, 1) && send(1, 35, 1) && send(2, 10, 1) && send(3, 30, 2));
	assert_string_equal(gave_way, "b");
}

/* Each peer has read a part of its bytes and asked for more: the time counts from when it last read. */
static void what_is_taken_counts(void **state)
{
	(void)state;
	assert_true(send(0, 40, 1) && send(1, 45, 2));
	peers[0].left -= 10;
	send_pool_sub(&peers[0].share, 10, 3);
	assert_true(send(0, 15, 4));
	assert_true(send(2, 40, 5));
	assert_string_equal(gave_way, "b");
	assert_true(peers[0].share.moved == 3 && pool.used == 85);
}

static void alone_it_may_be_of_any_size(void **state)
{
	(void)state;
	assert_true(send(0, 1000, 1));
	assert_string_equal(gave_way, "");
	assert_true(send(1, 1, 2)); /* the first peer holds so much that nothing can be sent to others */
	assert_string_equal(gave_way, "a");
	assert_true(pool.used == 1 && pool.leaving == 1000);
}

static void without_a_pool(void **state)
{
	(void)state;
	struct send_share s = {.pool = NULL};
	assert_true(send_pool_add(&s, UINT64_MAX, 1));
	send_pool_look(&s, 1);
	send_pool_sub(&s, UINT64_MAX, 1);
	send_pool_leave(&s);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(whoever_has_read_nothing_for_longest, begin, end),
		cmocka_unit_test_setup_teardown(little_is_left_alone, begin, end),
		cmocka_unit_test_setup_teardown(of_the_same_moment_the_most, begin, end),
		cmocka_unit_test_setup_teardown(what_is_taken_counts, begin, end),
		cmocka_unit_test_setup_teardown(alone_it_may_be_of_any_size, begin, end),
		cmocka_unit_test(without_a_pool),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
