/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Workers on slow links: a result that takes longer to send than a worker may be silent counts when it is complete,
 * because its bytes are signs of life; a worker that stops in the middle of a result is disconnected.
 */
#include "tests/support/child_server.h"

#include "common/base/clock.h"
#include "common/base/mem.h"
#include "tests/support/black_batch.h"
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
#define QUICK_HEARTBEAT 0.5

static int set_up_quick(void **state)
{
	(void)state;
	return child_server_start(60, QUICK_HEARTBEAT, 60);
}

/* Returns a worker that holds a lease of a new job, and makes its result. The keys of granted leases stay in the queue.
 */
static struct scripted_peer *make_worker_with_result(struct scripted_peer *client, struct pending_leases *d,
						     unsigned char **frame, size_t *size)
{
	struct scripted_peer *worker = child_server_connect();
	struct plan plan;
	struct error e;
	struct plan_request r = child_server_plan_request(NULL);
	assert_int_equal(plan_make(&r, &plan, &e), 0);
	assert_true(child_server_exchange_hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	child_server_submit(client, NULL, "<scene/>", "s.xml", "s.xml");
	if (child_server_receive_submit_answer(client)->n_missing) {
		child_server_send_blob(client, "<scene/>", "<scene/>");
		child_server_receive_submit_answer(client);
	}
	assert_true(child_server_exchange_hello(worker, FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
	child_server_send_empty(worker, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	while (d->count == 0)
		child_server_handle_message(worker, d);
	struct batch b = black_batch(&d->keys[0], &plan, 0);
	unsigned char *packed;
	assert_int_equal(batch_pack(&b, &plan, &packed, size, &e), 0);
	*frame = checksummed_frame(packed, *size, size);
	mem_free(packed);
	batch_fini(&b);
	return worker;
}

/* Returns false if this process stood still for so long that the coordinator may hang up on the worker. */
static bool send_slowly(struct scripted_peer *worker, const unsigned char *frame, size_t size)
{
	enum { PIECES = 24 };
	double begun = clock_seconds(), last = begun, longest = 0;
	size_t offset = 0;
	bool sent = true;
	for (size_t i = 1; i <= PIECES && sent; i++) {
		usleep(150000);
		size_t n = size * i / PIECES - offset;
		sent = send(worker->fd, frame + offset, n, MSG_NOSIGNAL) == (ssize_t)n;
		longest = fmax(longest, clock_seconds() - last);
		last = clock_seconds();
		offset += n;
	}
	if (longest > 4 * QUICK_HEARTBEAT)
		return false;
	struct pending_leases d = {.count = 0};
	assert_true(sent);
	assert_int_equal(child_server_await_verdict(worker, &d), FARM__VERDICT__VERDICT_MERGED);
	assert_true(worker->heartbeats >= (last - begun) / (QUICK_HEARTBEAT + longest) / 2 &&
		    worker->heartbeats <= (clock_seconds() - begun) / QUICK_HEARTBEAT + 2);
	return true;
}

/* Sending the result takes longer than a worker may be silent, and nothing else can be sent meanwhile; the coordinator
 * answers with heartbeats. */
static void slow_result_is_merged(void **state)
{
	(void)state;
	for (bool done = false; !done;) {
		unsigned char *frame;
		size_t size;
		struct pending_leases d = {.count = 0};
		struct scripted_peer *client = child_server_connect(),
				     *worker = make_worker_with_result(client, &d, &frame, &size);
		worker->heartbeats = 0;
		done = send_slowly(worker, frame, size);
		free(frame);
		scripted_peer_disconnect(client);
		scripted_peer_disconnect(worker);
	}
}

static void worker_that_stops_within_a_result_is_disconnected(void **state)
{
	(void)state;
	unsigned char *frame;
	size_t size;
	struct pending_leases d = {.count = 0};
	struct scripted_peer *client = child_server_connect(),
			     *worker = make_worker_with_result(client, &d, &frame, &size);
	child_server_send_bytes(worker, frame, size / 2);
	const Farm__Envelope *m;
	while ((m = scripted_peer_receive(worker)) && m->body_case != FARM__ENVELOPE__BODY_FAULT)
		continue;
	free(frame);
	scripted_peer_disconnect(client);
	scripted_peer_disconnect(worker);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(slow_result_is_merged),
					   cmocka_unit_test(worker_that_stops_within_a_result_is_disconnected)};
	return cmocka_run_group_tests(tests, set_up_quick, child_server_stop);
}
