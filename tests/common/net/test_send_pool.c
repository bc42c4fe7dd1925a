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
	uint64_t unsent_bytes;
} peers[PEERS];
static char giving_way_log[16];

static uint64_t unsent_bytes_of(const struct send_share *s)
{
	return ((const struct peer *)s)->unsent_bytes;
}

static void record_giving_way(struct send_share *s)
{
	size_t n = strlen(giving_way_log);
	giving_way_log[n] = (char)('a' + ((struct peer *)s - peers));
	giving_way_log[n + 1] = 0;
}

static int set_up(void **state)
{
	(void)state;
	pool = (struct send_pool){.max_bytes = 100};
	memset(peers, 0, sizeof peers);
	memset(giving_way_log, 0, sizeof giving_way_log);
	for (int i = 0; i < PEERS; i++)
		peers[i].share =
			(struct send_share){.pool = &pool, .unsent_bytes = unsent_bytes_of, .evict = record_giving_way};
	return 0;
}

/* All memory is given back in the end, whichever peers gave way. */
static int tear_down(void **state)
{
	(void)state;
	for (int i = 0; i < PEERS; i++) {
		send_pool_close_share(&peers[i].share);
		send_pool_subtract(&peers[i].share, peers[i].share.bytes, 0);
	}
	return pool.used_bytes || pool.closing_bytes || !LIST_EMPTY(&pool.waiting_shares);
}

static bool queue_bytes(int i, uint64_t bytes, uint64_t now)
{
	bool ok = send_pool_add(&peers[i].share, bytes, now);
	peers[i].unsent_bytes += ok ? bytes : 0;
	send_pool_note_progress(&peers[i].share, now);
	return ok;
}

/* The kernel takes a part of what waits, without reporting it. */
static void read_one_byte(int i)
{
	peers[i].unsent_bytes--;
}

static void peer_that_read_nothing_for_longest_gives_way(void **state)
{
	(void)state;
	assert_true(queue_bytes(0, 30, 1) && queue_bytes(1, 30, 2) && queue_bytes(2, 30, 3));
	assert_true(queue_bytes(3, 30, 4));
	assert_string_equal(giving_way_log, "a");
	assert_true(pool.used_bytes == 90 && pool.closing_bytes == 30);
	read_one_byte(1);
	assert_true(queue_bytes(3, 20, 5)); /* the second peer has just read */
	assert_string_equal(giving_way_log, "ac");
	send_pool_subtract(&peers[0].share, 30, 6);
	assert_int_equal(pool.closing_bytes, 30);
	assert_int_equal(pool.used_bytes, 80);
	/* the last peer holds most, and has read nothing since it was first sent something */
	assert_false(queue_bytes(3, 40, 6));
	assert_string_equal(giving_way_log, "acd");
	assert_int_equal(pool.used_bytes, 30);
}

static void peer_that_holds_little_does_not_give_way(void **state)
{
	(void)state;
	assert_true(queue_bytes(0, 5, 1) && queue_bytes(1, 60, 2) && queue_bytes(2, 5, 3) && queue_bytes(3, 25, 4));
	assert_true(queue_bytes(4, 10, 5));
	assert_string_equal(giving_way_log, "b");
	assert_true(queue_bytes(4, 70, 6)); /* on average the peers hold 11: this one holds less, and the fourth more */
	assert_string_equal(giving_way_log, "bd");
}

static void largest_of_equally_late_peers_gives_way(void **state)
{
	(void)state;
	assert_true(queue_bytes(0, 30, 1) && queue_bytes(1, 35, 1) && queue_bytes(2, 10, 1) && queue_bytes(3, 30, 2));
	assert_string_equal(giving_way_log, "b");
}

/* Each peer has read a part of its bytes and asked for more: the time counts from when it last read. */
static void waiting_time_counts_from_the_last_read(void **state)
{
	(void)state;
	assert_true(queue_bytes(0, 40, 1) && queue_bytes(1, 45, 2));
	peers[0].unsent_bytes -= 10;
	send_pool_subtract(&peers[0].share, 10, 3);
	assert_true(queue_bytes(0, 15, 4));
	assert_true(queue_bytes(2, 40, 5));
	assert_string_equal(giving_way_log, "b");
	assert_true(peers[0].share.progress_ms == 3 && pool.used_bytes == 85);
}

static void single_peer_may_queue_any_size(void **state)
{
	(void)state;
	assert_true(queue_bytes(0, 1000, 1));
	assert_string_equal(giving_way_log, "");
	assert_true(queue_bytes(1, 1, 2)); /* the first peer holds so much that nothing can be sent to others */
	assert_string_equal(giving_way_log, "a");
	assert_true(pool.used_bytes == 1 && pool.closing_bytes == 1000);
}

static void share_without_a_pool_is_unlimited(void **state)
{
	(void)state;
	struct send_share s = {.pool = NULL};
	assert_true(send_pool_add(&s, UINT64_MAX, 1));
	send_pool_note_progress(&s, 1);
	send_pool_subtract(&s, UINT64_MAX, 1);
	send_pool_close_share(&s);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(peer_that_read_nothing_for_longest_gives_way, set_up, tear_down),
		cmocka_unit_test_setup_teardown(peer_that_holds_little_does_not_give_way, set_up, tear_down),
		cmocka_unit_test_setup_teardown(largest_of_equally_late_peers_gives_way, set_up, tear_down),
		cmocka_unit_test_setup_teardown(waiting_time_counts_from_the_last_read, set_up, tear_down),
		cmocka_unit_test_setup_teardown(single_peer_may_queue_any_size, set_up, tear_down),
		cmocka_unit_test(share_without_a_pool_is_unlimited),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
