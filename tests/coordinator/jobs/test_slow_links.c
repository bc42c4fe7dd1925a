/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Workers on slow links: a result that takes longer to send than a worker may be silent counts when it is complete,
 * because its bytes are signs of life; a worker that stops in the middle of a result is disconnected.
 */
#include "tests/support/served.h"

#include "common/base/clock.h"
#include "common/base/mem.h"
#include "tests/support/black_results.h"
#include "tests/support/checksummed_frame.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

/* A worker that is silent for six heartbeats, 3 s, is disconnected. On a busy machine this process may be silent for
 * one. */
#define QUICK 0.5

static int set_up_quick(void **state)
{
	(void)state;
	return served_start(60, QUICK, 60);
}

/* Returns a worker that holds a lease of a new job, and makes its result. The keys of granted leases stay in the queue.
 */
static struct scripted *worker_with_result(struct scripted *client, struct lease_queue *d, unsigned char **frame,
					   size_t *size)
{
	struct scripted *worker = peer_call();
	struct plan plan;
	struct error e;
	struct plan_request r = peer_plan_request(NULL);
	assert_int_equal(plan_make(&r, &plan, &e), 0);
	assert_true(peer_hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	peer_submit(client, NULL, "<scene/>", "s.xml", "s.xml");
	if (peer_submit_answer(client)->n_missing) {
		peer_send_blob(client, "<scene/>", "<scene/>");
		peer_submit_answer(client);
	}
	assert_true(peer_hello(worker, FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
	peer_say_empty(worker, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	while (d->count == 0)
		peer_attend(worker, d);
	struct batch b = black_batch(&d->keys[0], &plan, 0);
	unsigned char *packed;
	assert_int_equal(batch_pack(&b, &plan, &packed, size, &e), 0);
	*frame = checksummed_frame(packed, *size, size);
	mem_free(packed);
	batch_fini(&b);
	return worker;
}

/* Returns false if this process stood still for so long that the coordinator may hang up on the worker. */
static bool sends_slowly(struct scripted *worker, const unsigned char *frame, size_t size)
{
	enum { PIECES = 24 };
	double begun = clock_seconds(), last = begun, longest = 0;
	size_t at = 0;
	bool sent = true;
	for (size_t i = 1; i <= PIECES && sent; i++) {
		usleep(150000);
		size_t n = size * i / PIECES - at;
		sent = send(worker->fd, frame + at, n, MSG_NOSIGNAL) == (ssize_t)n;
		longest = fmax(longest, clock_seconds() - last);
		last = clock_seconds();
		at += n;
	}
	if (longest > 4 * QUICK)
		return false;
	struct lease_queue d = {.count = 0};
	assert_true(sent);
	assert_int_equal(peer_verdict(worker, &d), FARM__VERDICT__VERDICT_MERGED);
	assert_true(worker->heartbeats >= (last - begun) / (QUICK + longest) / 2 &&
		    worker->heartbeats <= (clock_seconds() - begun) / QUICK + 2);
	return true;
}

/* Sending the result takes longer than a worker may be silent, and nothing else can be sent meanwhile; the coordinator
 * answers with heartbeats. */
static void a_slow_result_counts(void **state)
{
	(void)state;
	for (bool done = false; !done;) {
		unsigned char *frame;
		size_t size;
		struct lease_queue d = {.count = 0};
		struct scripted *client = peer_call(), *worker = worker_with_result(client, &d, &frame, &size);
		worker->heartbeats = 0;
		done = sends_slowly(worker, frame, size);
		free(frame);
		scripted_hang_up(client);
		scripted_hang_up(worker);
	}
}

static void half_a_result_is_no_word(void **state)
{
	(void)state;
	unsigned char *frame;
	size_t size;
	struct lease_queue d = {.count = 0};
	struct scripted *client = peer_call(), *worker = worker_with_result(client, &d, &frame, &size);
	peer_say_bytes(worker, frame, size / 2);
	const Farm__Envelope *m;
	while ((m = scripted_hear(worker)) && m->body_case != FARM__ENVELOPE__BODY_FAULT)
		continue;
	free(frame);
	scripted_hang_up(client);
	scripted_hang_up(worker);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(a_slow_result_counts),
					   cmocka_unit_test(half_a_result_is_no_word)};
	return cmocka_run_group_tests(tests, set_up_quick, served_stop);
}
