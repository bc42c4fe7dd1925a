/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Frames are sent in order, the first one as it is and each further one with a checksum; the waiting bytes are bounded,
 * in one queue and in all queues; errors end the queue. Runs over a pair of sockets whose far end is read by hand, so
 * that a peer can refuse to read. Of TLS only the memory that it takes is checked here; the rest is in test_net.
 */
#include "common/base/mem.h"
#include "common/net/send_queue.h"
#include "common/wire/frame.h"
#include "tests/support/tls_pair.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum {
	LIMIT = 1 << 20,
	KERNEL_BUFFER = 1 << 16,
	LARGE = 4 << 20 /* more than the kernel takes at once, which is 2 x KERNEL_BUFFER */
};

static uv_loop_t loop;
static struct send_pool pool;

static struct fixture {
	uv_pipe_t pipe;
	int far_socket;
	struct send_queue queue;
	int failure_count, drained_count;
	char why[80];
} fixture, other_fixture;

static void on_failed(void *user, const char *why)
{
	struct fixture *x = user;
	x->failure_count++;
	snprintf(x->why, sizeof x->why, "%s", why);
	send_queue_close(&x->queue, SEND_CLOSED);
}

static void on_drained(void *user)
{
	((struct fixture *)user)->drained_count++;
}

static const struct send_events events = {.failed = on_failed, .drained = on_drained};

static void fixture_init(struct fixture *x, size_t limit)
{
	int ends[2];
	memset(x, 0, sizeof *x);
	assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
	assert_int_equal(setsockopt(ends[0], SOL_SOCKET, SO_SNDBUF, &(int){KERNEL_BUFFER}, sizeof(int)), 0);
	x->far_socket = ends[1];
	assert_int_equal(uv_pipe_init(&loop, &x->pipe, 0), 0);
	assert_int_equal(uv_pipe_open(&x->pipe, ends[0]), 0);
	send_queue_init(&x->queue, (uv_stream_t *)&x->pipe, NULL, limit, &pool, &events, x);
}

static void fixture_fini(struct fixture *x)
{
	send_queue_close(&x->queue, SEND_CLOSED);
	uv_close((uv_handle_t *)&x->pipe, NULL);
	uv_run(&loop, UV_RUN_NOWAIT);
	assert_int_equal(x->queue.in_flight_bytes, 0);
	send_queue_fini(&x->queue);
	close(x->far_socket);
}

static int set_up(void **state)
{
	(void)state;
	pool = (struct send_pool){.max_bytes = 2 * LARGE + LIMIT};
	assert_int_equal(uv_loop_init(&loop), 0);
	fixture_init(&fixture, LIMIT);
	return 0;
}

static int tear_down(void **state)
{
	(void)state;
	fixture_fini(&fixture);
	assert_true(pool.used_bytes == 0 && pool.closing_bytes == 0 && LIST_EMPTY(&pool.waiting_shares));
	return uv_loop_close(&loop);
}

/* Returns a frame with `content` bytes of content, each of them `fill`. */
static unsigned char *make_frame(size_t content, unsigned char fill)
{
	unsigned char *frame = mem_alloc(FRAME_PREFIX_SIZE + content, 1);
	assert_non_null(frame);
	frame_prefix_write(frame, (uint32_t)content, 0);
	memset(frame + FRAME_PREFIX_SIZE, fill, content);
	return frame;
}

static void send_frame(size_t content, unsigned char fill)
{
	send_queue_send_frame(&fixture.queue, make_frame(content, fill), FRAME_PREFIX_SIZE + content);
}

static void let_time_pass(void)
{
	for (uint64_t then = uv_now(&loop); uv_now(&loop) < then + 2;)
		uv_update_time(&loop);
}

/* Two queues hold too much together: the one whose peer reads nothing gives way, though the other has waited longer. */
static void peer_that_reads_does_not_give_way(void **state)
{
	static char bytes[LIMIT];
	(void)state;
	fixture_init(&other_fixture, 2 * LARGE);
	send_queue_send_frame(&other_fixture.queue, make_frame(LARGE, 'a'), FRAME_PREFIX_SIZE + LARGE);
	let_time_pass();
	send_frame(LARGE, 'b');
	let_time_pass();
	assert_true(recv(other_fixture.far_socket, bytes, sizeof bytes, MSG_DONTWAIT) > 0);
	uv_run(&loop, UV_RUN_NOWAIT); /* the kernel took a part of a frame, without a report to the queue */
	assert_true(fixture.failure_count == 0 && pool.used_bytes > 2 * LARGE);
	send_queue_send_frame(&other_fixture.queue, make_frame(LIMIT, 'c'), FRAME_PREFIX_SIZE + LIMIT);
	assert_true(fixture.failure_count == 1 && fixture.queue.was_evicted && other_fixture.failure_count == 0);
	assert_string_equal(fixture.why, "too much waits to be sent to all peers, and this one does not read its part");
	assert_true(pool.closing_bytes > LARGE && pool.used_bytes > LARGE && pool.used_bytes <= pool.max_bytes);
	fixture_fini(&other_fixture);
}

/* Reads at the far end until `size` bytes have arrived. */
static unsigned char *receive_bytes(size_t size)
{
	unsigned char *bytes = malloc(size + 1);
	size_t offset = 0;
	assert_non_null(bytes);
	while (offset < size) {
		uv_run(&loop, UV_RUN_NOWAIT);
		assert_int_equal(fixture.failure_count, 0);
		ssize_t n = recv(fixture.far_socket, bytes + offset, size - offset, MSG_DONTWAIT);
		assert_true(n > 0 || (n < 0 && errno == EAGAIN));
		offset += n > 0 ? (size_t)n : 0;
	}
	return bytes;
}

static bool nothing_arrives(void)
{
	char byte;
	for (int i = 0; i < 10; i++)
		uv_run(&loop, UV_RUN_NOWAIT);
	return recv(fixture.far_socket, &byte, 1, MSG_DONTWAIT) < 0 && errno == EAGAIN;
}

static void first_frame_is_plain_and_later_ones_have_checksums(void **state)
{
	(void)state;
	size_t plain = FRAME_PREFIX_SIZE + 5, checked = FRAME_CHECKED_PREFIX_SIZE + 7;
	unsigned char *expected[] = {make_frame(5, 'a'), make_frame(7, 'b')}, head[FRAME_CHECKED_PREFIX_SIZE];
	send_frame(5, 'a');
	send_frame(7, 'b');
	assert_false(send_queue_is_empty(&fixture.queue));
	unsigned char *got = receive_bytes(plain + checked);
	frame_checked_prefix_write(head, expected[1], expected[1] + FRAME_PREFIX_SIZE, 7);
	assert_memory_equal(got, expected[0], plain);
	assert_memory_equal(got + plain, head, sizeof head);
	assert_memory_equal(got + plain + sizeof head, expected[1] + FRAME_PREFIX_SIZE, 7);
	assert_true(nothing_arrives());
	assert_int_equal(fixture.drained_count, 1); /* both frames were written in one turn of the loop */
	assert_true(send_queue_is_empty(&fixture.queue));
	free(got);
	mem_free(expected[0]);
	mem_free(expected[1]);
}

/* A single frame of any size may wait; further ones must fit below the limit. */
static void waiting_bytes_are_bounded(void **state)
{
	(void)state;
	send_frame(LARGE, 'a');
	assert_int_equal(fixture.failure_count, 0);
	assert_true(fixture.queue.unsent_bytes > LARGE);
	send_frame(1, 'b');
	assert_int_equal(fixture.failure_count, 1);
	assert_string_equal(fixture.why, "the peer does not read what is sent to it");
	assert_int_equal(fixture.drained_count, 0);
	send_frame(1, 'c'); /* freed, and no second failure is reported */
	assert_int_equal(fixture.failure_count, 1);
}

static void small_frames_count_with_their_overhead(void **state)
{
	(void)state;
	unsigned frame_count = 0;
	while (!fixture.failure_count && frame_count < LIMIT) {
		send_frame(1000, 'x');
		frame_count++;
	}
	/* Frames count with their overhead; bytes that the kernel took at once count until the loop reports them. */
	assert_in_range(frame_count, LIMIT / 1300, LIMIT / 1000);
}

/* A peer reads a long frame slowly through TLS. The whole frame stays in memory until its last piece is encrypted, and
 * so do the encrypted pieces that the kernel has not taken; the pool counts both. TLS itself adds less than a
 * hundredth. */
static void bytes_copied_by_tls_are_counted(void **state)
{
	(void)state;
	static char bytes[KERNEL_BUFFER / 2];
	size_t sent = 0, check_count = 0;
	tls_pair_handshake(tls_pair_path(tls_pair_ours, "node"), tls_pair_path(tls_pair_ours, "farm"), 1 << 14);
	fixture.queue.link = tls_pair_listener.link;
	fixture.queue.max_bytes = 2 * LARGE;
	send_frame(LARGE, 'a');
	send_frame(LIMIT / 2, 'b'); /* waits behind the long frame */
	while (!send_queue_is_empty(&fixture.queue)) {
		size_t frames = 0;
		if (!STAILQ_EMPTY(&fixture.queue.frames))
			frames += LIMIT / 2;
		if (fixture.queue.unsent_bytes >
		    LIMIT + LIMIT) /* the long frame is still in memory: all that libuv holds is part of it */
			frames += LARGE;
		check_count += frames > LARGE && sent > LARGE / 2;
		assert_true(pool.used_bytes + LARGE / 100 >= frames + fixture.queue.in_flight_bytes);
		assert_true(pool.used_bytes <= LARGE + LIMIT / 2 + fixture.queue.in_flight_bytes + 1024);
		ssize_t n = recv(fixture.far_socket, bytes, sizeof bytes, MSG_DONTWAIT);
		sent += n > 0 ? (size_t)n : 0;
		uv_run(&loop, UV_RUN_NOWAIT);
		assert_int_equal(fixture.failure_count, 0);
	}
	assert_true(check_count > 10);
	assert_int_equal(pool.used_bytes, 0);
	fixture.queue.link = NULL;
	tls_pair_close();
}

static void draining_sends_only_frames_already_queued(void **state)
{
	(void)state;
	send_frame(LARGE, 'a');
	send_queue_close(&fixture.queue, SEND_DRAINING);
	send_frame(3, 'b');
	free(receive_bytes(FRAME_PREFIX_SIZE + LARGE));
	assert_true(nothing_arrives());
	assert_int_equal(fixture.drained_count, 1);
	assert_int_equal(fixture.failure_count, 0);
}

static void states_only_advance(void **state)
{
	(void)state;
	send_queue_close(&fixture.queue, SEND_REFUSED);
	send_queue_close(&fixture.queue, SEND_DRAINING);
	assert_int_equal(fixture.queue.state, SEND_REFUSED);
	send_frame(3, 'a');
	send_queue_send_raw(&fixture.queue, "why", 3);
	unsigned char *got = receive_bytes(3);
	assert_memory_equal(got, "why", 3);
	assert_true(nothing_arrives());
	free(got);
}

/* A far end that is gone is an error of the stream, reported once. */
static void stream_error_is_reported_once(void **state)
{
	(void)state;
	close(fixture.far_socket);
	fixture.far_socket = dup(0);
	send_frame(3, 'a');
	send_frame(3, 'b');
	for (int i = 0; i < 10; i++)
		uv_run(&loop, UV_RUN_NOWAIT);
	assert_int_equal(fixture.failure_count, 1);
	assert_int_equal(fixture.drained_count, 0);
	assert_int_equal(fixture.queue.in_flight_bytes, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(first_frame_is_plain_and_later_ones_have_checksums, set_up, tear_down),
		cmocka_unit_test_setup_teardown(waiting_bytes_are_bounded, set_up, tear_down),
		cmocka_unit_test_setup_teardown(small_frames_count_with_their_overhead, set_up, tear_down),
		cmocka_unit_test_setup_teardown(peer_that_reads_does_not_give_way, set_up, tear_down),
		cmocka_unit_test_setup_teardown(bytes_copied_by_tls_are_counted, set_up, tear_down),
		cmocka_unit_test_setup_teardown(draining_sends_only_frames_already_queued, set_up, tear_down),
		cmocka_unit_test_setup_teardown(states_only_advance, set_up, tear_down),
		cmocka_unit_test_setup_teardown(stream_error_is_reported_once, set_up, tear_down),
	};
	signal(SIGPIPE, SIG_IGN);
	return cmocka_run_group_tests(tests, tls_pair_set_up, tls_pair_tear_down);
}
