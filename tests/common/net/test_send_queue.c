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
	KERNEL = 1 << 16,
	LARGE = 4 << 20 /* more than the kernel takes at once, which is 2 x KERNEL */
};

static uv_loop_t loop;
static struct send_pool pool;

static struct fixture {
	uv_pipe_t pipe;
	int far;
	struct send_queue queue;
	int failed, drained;
	char why[80];
} f, other;

static void on_failed(void *user, const char *why)
{
	struct fixture *x = user;
	x->failed++;
	snprintf(x->why, sizeof x->why, "%s", why);
	send_queue_close(&x->queue, SEND_CLOSED);
}

static void on_drained(void *user)
{
	((struct fixture *)user)->drained++;
}

static const struct send_events events = {.failed = on_failed, .drained = on_drained};

static void begin_one(struct fixture *x, size_t limit)
{
	int ends[2];
	memset(x, 0, sizeof *x);
	assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
	assert_int_equal(setsockopt(ends[0], SOL_SOCKET, SO_SNDBUF, &(int){KERNEL}, sizeof(int)), 0);
	x->far = ends[1];
	assert_int_equal(uv_pipe_init(&loop, &x->pipe, 0), 0);
	assert_int_equal(uv_pipe_open(&x->pipe, ends[0]), 0);
	send_queue_init(&x->queue, (uv_stream_t *)&x->pipe, NULL, limit, &pool, &events, x);
}

static void end_one(struct fixture *x)
{
	send_queue_close(&x->queue, SEND_CLOSED);
	uv_close((uv_handle_t *)&x->pipe, NULL);
	uv_run(&loop, UV_RUN_NOWAIT);
	assert_int_equal(x->queue.in_flight, 0);
	send_queue_fini(&x->queue);
	close(x->far);
}

static int begin(void **state)
{
	(void)state;
	pool = (struct send_pool){.limit = 2 * LARGE + LIMIT};
	assert_int_equal(uv_loop_init(&loop), 0);
	begin_one(&f, LIMIT);
	return 0;
}

static int end(void **state)
{
	(void)state;
	end_one(&f);
	assert_true(pool.used == 0 && pool.leaving == 0 && LIST_EMPTY(&pool.waiting));
	return uv_loop_close(&loop);
}

/* Returns a frame with `content` bytes of content, each of them `fill`. */
static unsigned char *frame_of(size_t content, unsigned char fill)
{
	unsigned char *frame = mem_alloc(FRAME_PREFIX + content, 1);
	assert_non_null(frame);
	frame_prefix_write(frame, (uint32_t)content, 0);
	memset(frame + FRAME_PREFIX, fill, content);
	return frame;
}

static void send_frame(size_t content, unsigned char fill)
{
	send_queue_frame(&f.queue, frame_of(content, fill), FRAME_PREFIX + content);
}

static void time_passes(void)
{
	for (uint64_t then = uv_now(&loop); uv_now(&loop) < then + 2;)
		uv_update_time(&loop);
}

/* Two queues hold too much together: the one whose peer reads nothing gives way, though the other has waited longer. */
static void who_reads_stays(void **state)
{
	static char bytes[LIMIT];
	(void)state;
	begin_one(&other, 2 * LARGE);
	send_queue_frame(&other.queue, frame_of(LARGE, 'a'), FRAME_PREFIX + LARGE);
	time_passes();
	send_frame(LARGE, 'b');
	time_passes();
	assert_true(recv(other.far, bytes, sizeof bytes, MSG_DONTWAIT) > 0);
	uv_run(&loop, UV_RUN_NOWAIT); /* the kernel took a part of a frame, without a report to the queue */
	assert_true(f.failed == 0 && pool.used > 2 * LARGE);
	send_queue_frame(&other.queue, frame_of(LIMIT, 'c'), FRAME_PREFIX + LIMIT);
	assert_true(f.failed == 1 && f.queue.gave_way && other.failed == 0);
	assert_string_equal(f.why, "too much waits to be sent to all peers, and this one does not read its part");
	assert_true(pool.leaving > LARGE && pool.used > LARGE && pool.used <= pool.limit);
	end_one(&other);
}

/* Reads at the far end until `size` bytes have arrived. */
static unsigned char *receive(size_t size)
{
	unsigned char *bytes = malloc(size + 1);
	size_t at = 0;
	assert_non_null(bytes);
	while (at < size) {
		uv_run(&loop, UV_RUN_NOWAIT);
		assert_int_equal(f.failed, 0);
		ssize_t n = recv(f.far, bytes + at, size - at, MSG_DONTWAIT);
		assert_true(n > 0 || (n < 0 && errno == EAGAIN));
		at += n > 0 ? (size_t)n : 0;
	}
	return bytes;
}

static bool nothing_comes(void)
{
	char byte;
	for (int i = 0; i < 10; i++)
		uv_run(&loop, UV_RUN_NOWAIT);
	return recv(f.far, &byte, 1, MSG_DONTWAIT) < 0 && errno == EAGAIN;
}

static void first_plain_then_checked(void **state)
{
	(void)state;
	size_t plain = FRAME_PREFIX + 5, checked = FRAME_CHECKED_PREFIX + 7;
	unsigned char *expected[] = {frame_of(5, 'a'), frame_of(7, 'b')}, head[FRAME_CHECKED_PREFIX];
	send_frame(5, 'a');
	send_frame(7, 'b');
	assert_false(send_queue_is_empty(&f.queue));
	unsigned char *got = receive(plain + checked);
	frame_add_checksums(head, expected[1], expected[1] + FRAME_PREFIX, 7);
	assert_memory_equal(got, expected[0], plain);
	assert_memory_equal(got + plain, head, sizeof head);
	assert_memory_equal(got + plain + sizeof head, expected[1] + FRAME_PREFIX, 7);
	assert_true(nothing_comes());
	assert_int_equal(f.drained, 1); /* both frames were written in one turn of the loop */
	assert_true(send_queue_is_empty(&f.queue));
	free(got);
	mem_free(expected[0]);
	mem_free(expected[1]);
}

/* A single frame of any size may wait; further ones must fit below the limit. */
static void what_waits_is_bounded(void **state)
{
	(void)state;
	send_frame(LARGE, 'a');
	assert_int_equal(f.failed, 0);
	assert_true(f.queue.unsent > LARGE);
	send_frame(1, 'b');
	assert_int_equal(f.failed, 1);
	assert_string_equal(f.why, "the peer does not read what is sent to it");
	assert_int_equal(f.drained, 0);
	send_frame(1, 'c'); /* freed, and no second failure is reported */
	assert_int_equal(f.failed, 1);
}

static void many_small_frames_reach_the_limit(void **state)
{
	(void)state;
	unsigned taken = 0;
	while (!f.failed && taken < LIMIT) {
		send_frame(1000, 'x');
		taken++;
	}
	/* Frames count with their overhead; bytes that the kernel took at once count until the loop reports them. */
	assert_in_range(taken, LIMIT / 1300, LIMIT / 1000);
}

/* A peer reads a long frame slowly through TLS. The whole frame stays in memory until its last piece is encrypted, and
 * so do the encrypted pieces that the kernel has not taken; the pool counts both. TLS itself adds less than a
 * hundredth. */
static void what_tls_copies_counts(void **state)
{
	(void)state;
	static char bytes[KERNEL / 2];
	size_t sent = 0, looks = 0;
	pair_shake(pair_at(pair_ours, "node"), pair_at(pair_ours, "farm"), 1 << 14);
	f.queue.link = pair_listener.link;
	f.queue.limit = 2 * LARGE;
	send_frame(LARGE, 'a');
	send_frame(LIMIT / 2, 'b'); /* waits behind the long frame */
	while (!send_queue_is_empty(&f.queue)) {
		size_t frames = 0;
		if (!STAILQ_EMPTY(&f.queue.frames))
			frames += LIMIT / 2;
		if (f.queue.unsent >
		    LIMIT + LIMIT) /* the long frame is still in memory: all that libuv holds is part of it */
			frames += LARGE;
		looks += frames > LARGE && sent > LARGE / 2;
		assert_true(pool.used + LARGE / 100 >= frames + f.queue.in_flight);
		assert_true(pool.used <= LARGE + LIMIT / 2 + f.queue.in_flight + 1024);
		ssize_t n = recv(f.far, bytes, sizeof bytes, MSG_DONTWAIT);
		sent += n > 0 ? (size_t)n : 0;
		uv_run(&loop, UV_RUN_NOWAIT);
		assert_int_equal(f.failed, 0);
	}
	assert_true(looks > 10);
	assert_int_equal(pool.used, 0);
	f.queue.link = NULL;
	pair_hang_up();
}

static void draining_sends_what_it_has(void **state)
{
	(void)state;
	send_frame(LARGE, 'a');
	send_queue_close(&f.queue, SEND_DRAINING);
	send_frame(3, 'b');
	free(receive(FRAME_PREFIX + LARGE));
	assert_true(nothing_comes());
	assert_int_equal(f.drained, 1);
	assert_int_equal(f.failed, 0);
}

static void states_only_advance(void **state)
{
	(void)state;
	send_queue_close(&f.queue, SEND_REFUSED);
	send_queue_close(&f.queue, SEND_DRAINING);
	assert_int_equal(f.queue.state, SEND_REFUSED);
	send_frame(3, 'a');
	send_queue_raw(&f.queue, "why", 3);
	unsigned char *got = receive(3);
	assert_memory_equal(got, "why", 3);
	assert_true(nothing_comes());
	free(got);
}

/* A far end that is gone is an error of the stream, reported once. */
static void error_of_the_stream(void **state)
{
	(void)state;
	close(f.far);
	f.far = dup(0);
	send_frame(3, 'a');
	send_frame(3, 'b');
	for (int i = 0; i < 10; i++)
		uv_run(&loop, UV_RUN_NOWAIT);
	assert_int_equal(f.failed, 1);
	assert_int_equal(f.drained, 0);
	assert_int_equal(f.queue.in_flight, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(first_plain_then_checked, begin, end),
		cmocka_unit_test_setup_teardown(what_waits_is_bounded, begin, end),
		cmocka_unit_test_setup_teardown(many_small_frames_reach_the_limit, begin, end),
		cmocka_unit_test_setup_teardown(who_reads_stays, begin, end),
		cmocka_unit_test_setup_teardown(what_tls_copies_counts, begin, end),
		cmocka_unit_test_setup_teardown(draining_sends_what_it_has, begin, end),
		cmocka_unit_test_setup_teardown(states_only_advance, begin, end),
		cmocka_unit_test_setup_teardown(error_of_the_stream, begin, end),
	};
	signal(SIGPIPE, SIG_IGN);
	return cmocka_run_group_tests(tests, pair_make_folders, pair_remove_folders);
}
