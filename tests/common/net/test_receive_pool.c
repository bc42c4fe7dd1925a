/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Frames that arrive on many connections at once never need more memory than the pool has: long frames wait for their
 * turn, one per owner; a peer that waits is not taken for dead or slow, and one that keeps others waiting must go on
 * sending. Short frames pass.
 */
#include "common/base/mem.h"
#include "common/net/conn.h"
#include "common/wire/frame.h"
#include "tests/support/checksummed_frame.h"
#include "tests/support/first_address.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <arpa/inet.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

/* ---- turns ---- */

static struct receive_turn turns[5];
static char turn_log[16];

static void record_turn(struct receive_turn *t)
{
	size_t n = strlen(turn_log);
	turn_log[n] = (char)('a' + (t - turns));
	turn_log[n + 1] = 0;
}

static bool take_bytes(struct receive_pool *p, int i, uint64_t bytes)
{
	turns[i].on_granted = record_turn;
	return receive_pool_acquire(p, &turns[i], bytes);
}

static void long_frames_wait_in_order(void **state)
{
	(void)state;
	struct receive_pool p = {.max_bytes = 100};
	memset(turns, 0, sizeof turns);
	assert_true(take_bytes(&p, 0, 60));
	assert_true(take_bytes(&p, 1, 40));
	assert_false(take_bytes(&p, 2, 70));
	assert_false(take_bytes(&p, 3, 1000)); /* alone, later */
	assert_false(take_bytes(&p, 4, 1));    /* there is room for it once one has gone, but others came first */
	receive_pool_release(&p, &turns[1]);
	assert_string_equal(turn_log, "");
	receive_pool_release(&p, &turns[0]);
	assert_string_equal(turn_log, "c");
	assert_true(turns[2].is_granted && !turns[2].is_waiting && p.used_bytes == 70);
	receive_pool_release(&p, &turns[2]);
	assert_string_equal(turn_log, "cd");
	assert_int_equal(p.used_bytes, 1000);
	receive_pool_release(&p, &turns[3]);
	assert_string_equal(turn_log, "cde");
	receive_pool_release(&p, &turns[4]);
	assert_true(p.used_bytes == 0 && !p.queue);
}

static void waiting_connection_may_leave_the_queue(void **state)
{
	(void)state;
	struct receive_pool p = {.max_bytes = 100};
	memset(turns, 0, sizeof turns);
	turn_log[0] = 0;
	assert_true(take_bytes(&p, 0, 100));
	for (int i = 1; i < 5; i++)
		assert_false(take_bytes(&p, i, 50));
	receive_pool_release(&p, &turns[4]); /* the last, one in the middle, the first */
	receive_pool_release(&p, &turns[2]);
	receive_pool_release(&p, &turns[1]);
	assert_false(take_bytes(&p, 4, 10));
	assert_string_equal(turn_log, "");
	receive_pool_release(&p, &turns[0]);
	assert_string_equal(turn_log, "de");
	assert_int_equal(p.used_bytes, 60);
}

static void owners_take_turns(void **state)
{
	(void)state;
	struct receive_pool p = {.max_bytes = 100};
	memset(turns, 0, sizeof turns);
	turn_log[0] = 0;
	turns[3].owner = turns[4].owner = 7;
	for (int i = 0; i < 4; i++)
		assert_true(take_bytes(&p, i, 100) == (i == 0));
	receive_pool_release(&p, &turns[0]);
	assert_false(take_bytes(&p, 4, 100));
	assert_false(take_bytes(&p, 0, 100));
	receive_pool_release(&p, &turns[1]);
	receive_pool_release(&p, &turns[3]);
	receive_pool_release(&p, &turns[2]);
	receive_pool_release(&p, &turns[4]);
	receive_pool_release(&p, &turns[0]);
	assert_string_equal(turn_log, "bdcea");
	assert_true(p.used_bytes == 0 && !p.queue);
}

/* ---- connections ---- */

enum { PEERS = 4, ENDS = PEERS + 1, LONG = 1 << 20, HALF = LONG / 2, PROMISED_SIZE = 1 << 26, PROMISED_PART = 100000 };

struct end {
	struct conn *conn;
	int partial_count, message_count, close_count;
	char why[128];
};

static uv_loop_t loop;
static uv_tcp_t listener;
static struct net_addr bound;
static struct conn_config config;
static struct receive_pool pool;
static struct end callers[PEERS], ends[ENDS];
static int accepted_count, arrival_order[ENDS], arrived_count;

static void on_message(void *user, struct envelope *env, const unsigned char *payload, size_t size)
{
	struct end *x = user;
	(void)env;
	(void)payload;
	x->message_count++;
	if (size >= LONG)
		arrival_order[arrived_count++] = (int)(x - ends);
}

static void on_partial(void *user)
{
	((struct end *)user)->partial_count++;
}

static void on_closed(void *user, const char *why)
{
	struct end *x = user;
	x->close_count++;
	x->conn = NULL;
	snprintf(x->why, sizeof x->why, "%s", why);
}

static const struct conn_events events = {.message = on_message, .partial = on_partial, .closed = on_closed};

static void on_connection(uv_stream_t *l, int status)
{
	struct error e;
	assert_int_equal(status, 0);
	assert_int_equal(conn_accept(&ends[accepted_count].conn, l, &config, &events, &ends[accepted_count], &e), 0);
	accepted_count++;
}

static void run_loop_once(void)
{
	uv_run(&loop, UV_RUN_ONCE);
}

/* Sends the bytes of a frame, or part of it, as a caller would after its hello. */
static void send_bytes(int i, const unsigned char *bytes, size_t size)
{
	unsigned char *copy = mem_alloc(size, 1);
	assert_non_null(copy);
	conn_send_bytes(callers[i].conn, memcpy(copy, bytes, size), size);
}

static unsigned char *make_long_frame(size_t *size)
{
	unsigned char *payload = calloc(LONG, 1);
	assert_non_null(payload);
	unsigned char *frame = checksummed_frame_from_message(ENVELOPE(BYE, bye), payload, LONG, size);
	free(payload);
	return frame;
}

static void send_short(int i)
{
	conn_send(callers[i].conn, ENVELOPE(BYE, bye), NULL, 0);
}

/* Opens a connection from another machine: a plain socket at an address of its own. */
static int connect_from_another_machine(void)
{
	struct sockaddr_in from = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK + 1)};
	unsigned char *frame;
	size_t size;
	struct error e;
	int fd = socket(AF_INET, SOCK_STREAM, 0), i = accepted_count;
	assert_int_equal(bind(fd, (struct sockaddr *)&from, sizeof from), 0);
	assert_int_equal(connect(fd, (struct sockaddr *)&bound.storage, sizeof from), 0);
	assert_int_equal(envelope_pack(ENVELOPE(BYE, bye), NULL, 0, &frame, &size, &e), 0);
	assert_int_equal(send(fd, frame, size, 0), size);
	mem_free(frame);
	while (accepted_count == i || !ends[i].message_count)
		run_loop_once();
	return fd;
}

static void open_all(double stall_seconds)
{
	struct net_addr a;
	struct error e;
	int length = sizeof bound.storage;
	memset(callers, 0, sizeof callers);
	memset(ends, 0, sizeof ends);
	memset(&bound, 0, sizeof bound);
	accepted_count = arrived_count = 0;
	pool = (struct receive_pool){.max_bytes = LONG + HALF};
	config = (struct conn_config){{4096, PROMISED_SIZE}, 8 << 20, stall_seconds, 0, NULL, &pool, NULL};
	struct conn_config caller = config;
	caller.receive_pool = NULL;
	assert_int_equal(uv_loop_init(&loop), 0);
	uv_tcp_init(&loop, &listener);
	assert_int_equal(first_address_resolve(&a, "127.0.0.1:0", &e), 0);
	assert_int_equal(uv_tcp_bind(&listener, (struct sockaddr *)&a.storage, 0), 0);
	assert_int_equal(uv_listen((uv_stream_t *)&listener, 8, on_connection), 0);
	assert_int_equal(uv_tcp_getsockname(&listener, (struct sockaddr *)&bound.storage, &length), 0);
	for (int i = 0; i < PEERS; i++) {
		assert_int_equal(conn_connect(&callers[i].conn, &loop, &bound, &caller, &events, &callers[i], &e), 0);
		while (accepted_count <= i)
			run_loop_once();
		send_short(i); /* the first frame of a connection, which has no checksum */
		while (!ends[i].message_count)
			run_loop_once();
	}
}

static void close_all(void)
{
	for (int i = 0; i < PEERS; i++)
		if (callers[i].conn)
			conn_close(callers[i].conn, "the end");
	for (int i = 0; i < ENDS; i++)
		if (ends[i].conn)
			conn_close(ends[i].conn, "the end");
	uv_close((uv_handle_t *)&listener, NULL);
	uv_run(&loop, UV_RUN_DEFAULT);
	assert_int_equal(uv_loop_close(&loop), 0);
	assert_true(pool.used_bytes == 0 && !pool.queue);
}

static void wait_for_queue(void)
{
	while (!pool.queue)
		run_loop_once();
}

static unsigned count_waiting(void)
{
	unsigned n = 0;
	for (const struct receive_turn *t = pool.queue; t; t = t->next)
		n++;
	return n;
}

/* The first peer has sent half of its frame. Others send all of theirs, and wait; short messages of another peer pass.
 */
static void long_frames_arrive_one_at_a_time(void **state)
{
	(void)state;
	size_t size;
	unsigned char *frame = make_long_frame(&size);
	open_all(1000);
	send_bytes(0, frame, HALF);
	while (!pool.used_bytes)
		run_loop_once();
	for (int i = 1; i < 3; i++) {
		send_bytes(i, frame, size);
		while (count_waiting() < (unsigned)i)
			run_loop_once();
	}
	send_short(3);
	while (ends[3].message_count < 2)
		run_loop_once();
	assert_true(arrived_count == 0 && count_waiting() == 2 && pool.used_bytes <= pool.max_bytes);
	send_bytes(0, frame + HALF, size - HALF);
	while (arrived_count < 3)
		run_loop_once();
	assert_true(arrival_order[0] == 0 && arrival_order[1] == 1 && arrival_order[2] == 2);
	/* a peer that hangs up lets the next one go on */
	send_bytes(0, frame, HALF);
	while (!pool.used_bytes)
		run_loop_once();
	send_bytes(1, frame, size);
	wait_for_queue();
	conn_close(callers[0].conn, "enough");
	while (arrived_count < 4)
		run_loop_once();
	assert_int_equal(arrival_order[3], 1);
	close_all();
	free(frame);
}

static size_t send_part(int fd, const unsigned char *bytes, size_t size)
{
	ssize_t n = size ? send(fd, bytes, size, MSG_DONTWAIT) : 0;
	uv_run(&loop, UV_RUN_NOWAIT);
	return n > 0 ? (size_t)n : 0;
}

/* Four connections of one machine come first; a caller from another machine waits for one of them, not for all. */
static void machines_take_turns(void **state)
{
	(void)state;
	size_t size;
	unsigned char *frame = make_long_frame(&size);
	open_all(1000);
	int fd = connect_from_another_machine();
	send_bytes(0, frame, HALF);
	while (!pool.used_bytes)
		run_loop_once();
	for (int i = 1; i < 4; i++) {
		send_bytes(i, frame, size);
		while (count_waiting() < (unsigned)i)
			run_loop_once();
	}
	size_t offset = 0;
	while (count_waiting() < 4)
		offset += send_part(fd, frame + offset, size - offset);
	send_bytes(0, frame + HALF, size - HALF);
	while (arrived_count < ENDS)
		offset += send_part(fd, frame + offset, size - offset);
	static const int fair[ENDS] = {0, 1, 4, 2, 3};
	assert_memory_equal(arrival_order, fair, sizeof fair);
	close(fd);
	close_all();
	free(frame);
}

/* Sends the head of a frame so long that it may take minutes, and nothing more. */
static void send_unfinished_frame(int i)
{
	static unsigned char frame[FRAME_CHECKED_PREFIX_SIZE + PROMISED_PART];
	unsigned char prefix[FRAME_PREFIX_SIZE];
	frame_prefix_write(prefix, 16, PROMISED_SIZE);
	frame_checked_prefix_write(frame, prefix, frame + FRAME_CHECKED_PREFIX_SIZE, PROMISED_PART);
	send_bytes(i, frame, sizeof frame);
}

static void stalled_frame_times_out_while_others_wait(void **state)
{
	(void)state;
	size_t size;
	unsigned char *frame = make_long_frame(&size);
	open_all(0.5);
	send_unfinished_frame(0);
	while (!pool.used_bytes)
		run_loop_once();
	for (int i = 0; i < PEERS; i++)
		conn_set_idle_timeout(ends[i].conn, i ? 0.5 : 0);
	send_bytes(1, frame, size);
	wait_for_queue();
	int partial_before = ends[1].partial_count;
	while (!arrived_count) /* longer than a peer may be silent, and longer than a frame of this length may pause */
		run_loop_once();
	assert_true(ends[0].close_count && strstr(ends[0].why, "not completed in time"));
	assert_true(ends[1].partial_count > partial_before && !ends[1].close_count);
	close_all();
	free(frame);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(long_frames_wait_in_order),
					   cmocka_unit_test(waiting_connection_may_leave_the_queue),
					   cmocka_unit_test(long_frames_arrive_one_at_a_time),
					   cmocka_unit_test(machines_take_turns),
					   cmocka_unit_test(owners_take_turns),
					   cmocka_unit_test(stalled_frame_times_out_while_others_wait)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
