/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Connections carry frames both ways, report their end once, and never grow without bound, in plaintext and through
 * TLS. If only one end speaks TLS, both ends report it at once.
 */
#include "common/base/mem.h"
#include "common/net/authority.h"
#include "common/net/conn.h"
#include "tests/support/checksummed_frame.h"
#include "tests/support/first_address.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* ---- two ends on one loop ---- */

struct end {
	struct conn *conn;
	int message_count, close_count, drain_count, partial_count;
	size_t payload_bytes;
	bool garbled, gave_way;
	int distrust;
	struct tls_peer peer; /* the peer, as it was when a message arrived */
	char why[128];
};

static uv_loop_t loop;
static uv_tcp_t listener;
static struct end caller_end, listener_end;
static struct conn_config config;
static struct send_pool *shared_send_pool; /* NULL: no limit on all connections together */
static char folder[64];
static struct tls *caller_tls, *listener_tls; /* NULL: plaintext */

static void on_message(void *user, struct envelope *env, const unsigned char *payload, size_t size)
{
	struct end *x = user;
	assert_int_equal(env->message->body_case, FARM__ENVELOPE__BODY_BYE);
	for (size_t i = 0; i < size; i++)
		assert_int_equal(payload[i], (unsigned char)(i * 7));
	if (conn_peer(x->conn))
		x->peer = *conn_peer(x->conn);
	x->message_count++;
	x->payload_bytes += size;
}

static void on_drained(void *user)
{
	((struct end *)user)->drain_count++;
}

static void on_partial(void *user)
{
	((struct end *)user)->partial_count++;
}

static void on_closed(void *user, const char *why)
{
	struct end *x = user;
	x->close_count++;
	x->distrust = conn_certificate_error(x->conn);
	x->garbled = conn_had_bad_checksum(x->conn);
	x->gave_way = conn_was_evicted(x->conn);
	x->conn = NULL;
	snprintf(x->why, sizeof x->why, "%s", why);
}

static const struct conn_events events = {
	.message = on_message, .partial = on_partial, .drained = on_drained, .closed = on_closed};

static void on_connection(uv_stream_t *l, int status)
{
	struct error e;
	assert_int_equal(status, 0);
	assert_int_equal(conn_accept(&listener_end.conn, l, &config, &events, &listener_end, &e), 0);
}

static void send_bye(struct end *x, size_t payload)
{
	Farm__Bye bye;
	Farm__Envelope m;
	unsigned char *bytes = malloc(payload + 1);
	assert_non_null(bytes);
	for (size_t i = 0; i < payload; i++)
		bytes[i] = (unsigned char)(i * 7);
	farm__bye__init(&bye);
	farm__envelope__init(&m);
	m.body_case = FARM__ENVELOPE__BODY_BYE;
	m.bye = &bye;
	conn_send(x->conn, &m, bytes, payload);
	free(bytes);
}

static void connect_ends(void)
{
	struct net_addr a, bound;
	struct error e;
	int length = sizeof bound.storage;
	struct conn_config caller;
	memset(&caller_end, 0, sizeof caller_end);
	memset(&listener_end, 0, sizeof listener_end);
	memset(&bound, 0, sizeof bound);
	config = (struct conn_config){{4096, 1 << 20}, 4 << 20, 0.5, 0, listener_tls, NULL, shared_send_pool};
	caller = config;
	caller.send_pool = NULL;
	caller.tls = caller_tls;
	assert_int_equal(uv_loop_init(&loop), 0);
	uv_tcp_init(&loop, &listener);
	assert_int_equal(first_address_resolve(&a, "127.0.0.1:0", &e), 0);
	assert_int_equal(uv_tcp_bind(&listener, (struct sockaddr *)&a.storage, 0), 0);
	assert_int_equal(uv_listen((uv_stream_t *)&listener, 8, on_connection), 0);
	assert_int_equal(uv_tcp_getsockname(&listener, (struct sockaddr *)&bound.storage, &length), 0);
	assert_int_equal(conn_connect(&caller_end.conn, &loop, &bound, &caller, &events, &caller_end, &e), 0);
	while (!listener_end.conn)
		uv_run(&loop, UV_RUN_ONCE);
}

static void close_ends(void)
{
	if (caller_end.conn)
		conn_close(caller_end.conn, "test over");
	if (listener_end.conn)
		conn_close(listener_end.conn, "test over");
	uv_close((uv_handle_t *)&listener, NULL);
	uv_run(&loop, UV_RUN_DEFAULT);
	assert_int_equal(uv_loop_close(&loop), 0); /* no handle is left open */
	assert_true(caller_end.close_count == 1 && listener_end.close_count == 1);
}

static void frames_go_both_ways(void **state)
{
	(void)state;
	connect_ends();
	for (int i = 0; i < 3; i++) {
		send_bye(&caller_end, (size_t)i * 300000);
		send_bye(&listener_end, 1);
	}
	while (listener_end.message_count < 3 || caller_end.message_count < 3 || !caller_end.drain_count)
		uv_run(&loop, UV_RUN_ONCE);
	assert_int_equal(listener_end.payload_bytes, 900000);
	assert_string_equal(listener_end.peer.name, caller_tls ? "node" : "");
	assert_int_equal(caller_end.peer.role, caller_tls ? TLS_COORDINATOR : TLS_NO_ROLE);
	conn_close_when_sent(caller_end.conn, "said all");
	while (!listener_end.close_count)
		uv_run(&loop, UV_RUN_ONCE);
	assert_string_equal(listener_end.why, "the peer hung up");
	assert_string_equal(caller_end.why, "said all");
	close_ends();
}

static void data_sent_before_a_close_arrives(void **state)
{
	(void)state;
	connect_ends();
	send_bye(&caller_end, 1 << 20);
	conn_close_when_sent(caller_end.conn, "done");
	send_bye(&caller_end, 1); /* too late: dropped */
	while (!listener_end.close_count)
		uv_run(&loop, UV_RUN_ONCE);
	assert_int_equal(listener_end.message_count, 1);
	close_ends();
}

static void frame_beyond_the_limits_closes_the_connection(void **state)
{
	(void)state;
	connect_ends();
	send_bye(&caller_end, (1 << 20) + 1);
	while (!listener_end.close_count)
		uv_run(&loop, UV_RUN_ONCE);
	assert_non_null(strstr(listener_end.why, "payload"));
	close_ends();
}

static void peer_that_does_not_read_is_cut_off(void **state)
{
	(void)state;
	connect_ends();
	/* The loop does not run in between, so nothing is sent: first the kernel's buffers fill, then the connection's
	 * queue. */
	for (int i = 0; i < 1000 && !caller_end.close_count; i++)
		send_bye(&caller_end, 1 << 20);
	while (!caller_end.close_count)
		uv_run(&loop, UV_RUN_ONCE);
	assert_non_null(strstr(caller_end.why, "does not read"));
	close_ends();
}

/* The limit over all connections: bytes that a reading peer has taken no longer count, and a peer that does not read is
 * cut off. */
static void peer_that_does_not_read_is_cut_off_at_the_shared_limit(void **state)
{
	(void)state;
	struct send_pool pool = {.max_bytes = 2 << 20};
	int unread_count = 0;
	shared_send_pool = &pool;
	connect_ends();
	shared_send_pool = NULL;
	for (int i = 1; i <= 8; i++) {
		send_bye(&listener_end, 1 << 20);
		assert_true(pool.used_bytes > 1 << 20);
		while (caller_end.message_count < i)
			uv_run(&loop, UV_RUN_ONCE);
		for (int k = 0; k < 100 && pool.used_bytes; k++)
			uv_run(&loop, UV_RUN_NOWAIT);
		assert_true(pool.used_bytes == 0 && listener_end.close_count == 0);
	}
	for (; !pool.closing_bytes && unread_count < 32; unread_count++)
		send_bye(&listener_end, 1 << 20);
	/* Of a frame whose room was reserved before TLS encrypts it. */
	const uint64_t copied = caller_tls ? 1 << 20 : 0;
	assert_true(unread_count > 1 && unread_count < 32 && pool.used_bytes == 0 && pool.closing_bytes > 1 << 20 &&
		    pool.closing_bytes <= pool.max_bytes + copied);
	while (!listener_end.close_count || !caller_end.close_count)
		uv_run(&loop, UV_RUN_ONCE);
	assert_true(listener_end.gave_way && pool.used_bytes == 0 && pool.closing_bytes == 0 &&
		    LIST_EMPTY(&pool.waiting_shares));
	assert_string_equal(listener_end.why,
			    "too much waits to be sent to all peers, and this one does not read its part");
	close_ends();
}

static void incomplete_frame_times_out(void **state)
{
	(void)state;
	connect_ends();
	unsigned char *half = mem_alloc(11, 1);
	memcpy(half, "\0\0\0\x20\0\0\0\0abc", 11);
	conn_send_bytes(caller_end.conn, half, 11);
	uint64_t begun = uv_hrtime();
	while (!listener_end.close_count)
		uv_run(&loop, UV_RUN_ONCE);
	double seconds = (double)(uv_hrtime() - begun) * 1e-9;
	assert_true(seconds > 0.4 && seconds < 60);
	assert_non_null(strstr(listener_end.why, "not completed"));
	close_ends();
}

/* A bit of the second message changes in transit: the connection closes. The first message (in practice a hello) is not
 * protected. */
static void changed_bytes_close_the_connection(void **state)
{
	(void)state;
	Farm__Bye bye;
	Farm__Envelope m;
	farm__bye__init(&bye);
	farm__envelope__init(&m);
	m.body_case = FARM__ENVELOPE__BODY_BYE;
	m.bye = &bye;
	for (int where = 0; where < 4; where++) {
		size_t size;
		unsigned char payload[1000] = {0},
			      *bytes = checksummed_frame_from_message(&m, payload, sizeof payload, &size);
		static const size_t places[] = {1, 9, 17, 700}; /* in a length, a checksum, the header, the payload */
		bytes[places[where]] ^= 4;
		connect_ends();
		send_bye(&caller_end, 10);
		unsigned char *copy = mem_alloc(size, 1);
		memcpy(copy, bytes, size);
		conn_send_bytes(caller_end.conn, copy, size);
		while (!listener_end.close_count)
			uv_run(&loop, UV_RUN_ONCE);
		assert_true(listener_end.garbled && !listener_end.distrust);
		assert_int_equal(listener_end.message_count, 1);
		assert_non_null(strstr(listener_end.why, "changed in transit"));
		close_ends();
		free(bytes);
	}
}

static void silent_peer_times_out(void **state)
{
	(void)state;
	connect_ends();
	conn_set_idle_timeout(listener_end.conn, 0.3);
	while (!listener_end.close_count)
		uv_run(&loop, UV_RUN_ONCE);
	assert_non_null(strstr(listener_end.why, "silent for too long"));
	close_ends();
}

/* One frame with a payload, sent piece by piece. */
enum { PAYLOAD = 1 << 20, PIECE = PAYLOAD / 16 };

struct drip {
	uv_timer_t timer;
	unsigned char *bytes;
	size_t size, offset;
};

static void on_drip(uv_timer_t *t)
{
	struct drip *d = t->data;
	size_t n = d->size - d->offset < PIECE ? d->size - d->offset : PIECE;
	unsigned char *piece = mem_alloc(n, 1);
	memcpy(piece, d->bytes + d->offset, n);
	conn_send_bytes(caller_end.conn, piece, n);
	d->offset += n;
	if (d->offset == d->size)
		uv_timer_stop(t);
}

/* However many frames a peer has sent, only a few are handled before other sockets are looked at; the peer may send
 * them all and hang up. */
static void many_frames_do_not_starve_other_sockets(void **state)
{
	(void)state;
	enum { FRAMES = 8000, BYTES = 100, FRAMES_PER_TURN_MAX = 16 };
	int previous = 0, max_frames = 0;
	connect_ends();
	for (int i = 0; i < FRAMES; i++)
		send_bye(&caller_end, BYTES);
	conn_close_when_sent(caller_end.conn, "said all");
	while (listener_end.message_count < FRAMES && !listener_end.close_count) {
		uv_run(&loop, UV_RUN_ONCE);
		max_frames = listener_end.message_count - previous > max_frames ? listener_end.message_count - previous
										: max_frames;
		previous = listener_end.message_count;
	}
	assert_int_equal(listener_end.message_count, FRAMES);
	assert_in_range(max_frames, 1, FRAMES_PER_TURN_MAX);
	while (!listener_end.close_count)
		uv_run(&loop, UV_RUN_ONCE);
	assert_string_equal(listener_end.why, "the peer hung up");
	close_ends();
}

/* While connections that gave way still hold memory, nothing is read that may need more, and frames that were already
 * read wait. */
static void frames_wait_for_memory(void **state)
{
	(void)state;
	enum { FRAMES = 100 };
	struct send_pool pool = {.max_bytes = 1 << 20};
	shared_send_pool = &pool;
	connect_ends();
	shared_send_pool = NULL;
	for (int i = 0; i < FRAMES; i++)
		send_bye(&caller_end, 0);
	while (!listener_end.message_count)
		uv_run(&loop, UV_RUN_ONCE);
	const int before = listener_end.message_count;
	assert_in_range(before, 1, FRAMES - 1);
	pool.closing_bytes = 1;
	for (int i = 0; i < FRAMES; i++)
		uv_run(&loop, UV_RUN_NOWAIT);
	assert_int_equal(listener_end.message_count, before);
	pool.closing_bytes = 0;
	while (listener_end.message_count < FRAMES)
		uv_run(&loop, UV_RUN_ONCE);
	close_ends();
}

/* The bytes of a slow frame count as signs of life. It is complete after 0.8 s; it may take 16.5 s: half a second plus
 * one for each 64 KB. */
static void slow_frame_counts_as_a_sign_of_life(void **state)
{
	(void)state;
	Farm__Bye bye;
	Farm__Envelope m;
	struct drip d = {.offset = 0};
	unsigned char *payload = mem_alloc(PAYLOAD, 1);
	for (size_t i = 0; i < PAYLOAD; i++)
		payload[i] = (unsigned char)(i * 7);
	farm__bye__init(&bye);
	farm__envelope__init(&m);
	m.body_case = FARM__ENVELOPE__BODY_BYE;
	m.bye = &bye;
	d.bytes = checksummed_frame_from_message(&m, payload, PAYLOAD, &d.size);
	connect_ends();
	send_bye(&caller_end, 0);
	while (!listener_end.message_count)
		uv_run(&loop, UV_RUN_ONCE);
	assert_int_equal(listener_end.partial_count, 0); /* no frame was under way */
	conn_set_idle_timeout(listener_end.conn, 0.3);
	d.timer.data = &d;
	uv_timer_init(&loop, &d.timer);
	uv_timer_start(&d.timer, on_drip, 50, 50);
	while (listener_end.message_count < 2 && !listener_end.close_count)
		uv_run(&loop, UV_RUN_ONCE);
	assert_int_equal(listener_end.message_count, 2);
	assert_true(listener_end.partial_count >= 15);
	uv_close((uv_handle_t *)&d.timer, NULL);
	close_ends();
	free(d.bytes);
	mem_free(payload);
}

/* A peer is not blamed for what was not read: the timeouts for silence and for incomplete frames stand still with the
 * loop. */
static void stalled_loop_times_out_no_peer(void **state)
{
	(void)state;
	connect_ends();
	conn_set_idle_timeout(listener_end.conn, 0.5);
	send_bye(&caller_end, 1000);
	struct timespec stall = {0, 800000000};
	nanosleep(&stall, NULL);
	uv_run(&loop, UV_RUN_ONCE);
	send_bye(&caller_end, 1000);
	while (listener_end.message_count < 2 && !listener_end.close_count)
		uv_run(&loop, UV_RUN_ONCE);
	assert_int_equal(listener_end.message_count, 2);
	close_ends();
}

/* ---- TLS ---- */

static int set_up_plaintext(void **state)
{
	(void)state;
	caller_tls = listener_tls = NULL;
	return 0;
}

static int set_up_tls(void **state)
{
	(void)state;
	char path[128];
	struct error e;
	snprintf(folder, sizeof folder, "/tmp/hslt-net.XXXXXX");
	if (!mkdtemp(folder) || authority_create(folder, "net", 2, &e) ||
	    authority_issue(folder, "farm", TLS_COORDINATOR, 1, false, &e) ||
	    authority_issue(folder, "node", TLS_WORKER, 1, false, &e))
		return -1;
	snprintf(path, sizeof path, "%s/node", folder);
	if (tls_open(&caller_tls, path, &e))
		return -1;
	snprintf(path, sizeof path, "%s/farm", folder);
	return tls_open(&listener_tls, path, &e);
}

static int tear_down_tls(void **state)
{
	(void)state;
	char command[128];
	tls_close(caller_tls);
	tls_close(listener_tls);
	snprintf(command, sizeof command, "rm -rf '%s'", folder);
	return system(command);
}

/* Only the last end to connect speaks, or stays silent, as told: both ends hear what is wrong before the handshake
 * times out. */
static void check_one_sided_tls(bool caller_speaks)
{
	struct tls *t = caller_speaks ? listener_tls : caller_tls;
	*(caller_speaks ? &listener_tls : &caller_tls) = NULL;
	connect_ends();
	send_bye(&caller_end, 10);
	while (!caller_end.close_count || !listener_end.close_count)
		uv_run(&loop, UV_RUN_ONCE);
	assert_true(!strstr(caller_end.why, "in time") && !strstr(listener_end.why, "in time"));
	assert_true(caller_end.distrust == -EACCES && listener_end.distrust == -EACCES && !caller_end.message_count &&
		    !listener_end.message_count);
	assert_non_null(strstr(caller_end.why, "TLS"));
	assert_non_null(strstr(listener_end.why, "TLS"));
	close_ends();
	*(caller_speaks ? &listener_tls : &caller_tls) = t;
}

static void one_sided_tls_is_reported_at_both_ends(void **state)
{
	(void)state;
	check_one_sided_tls(true);
	check_one_sided_tls(false);
}

/* A peer that connects and says nothing, or a byte now and then, has as long as a handshake may take; in this test the
 * clock is the timeout for silence. */
static void silent_handshake_times_out(void **state)
{
	(void)state;
	struct tls *t = caller_tls;
	caller_tls = NULL;
	connect_ends();
	conn_set_idle_timeout(listener_end.conn, 0.3);
	while (!listener_end.close_count)
		uv_run(&loop, UV_RUN_ONCE);
	assert_int_equal(listener_end.message_count, 0);
	close_ends();
	caller_tls = t;
}

/* A connection whose certificate is no longer valid is cut off while it is open. */
static void revocation_cuts_off_an_open_connection(void **state)
{
	(void)state;
	char list[128];
	unsigned count;
	struct error e;
	connect_ends();
	tls_set_recheck(listener_tls, 0.3);
	send_bye(&caller_end, 1);
	while (!listener_end.message_count)
		uv_run(&loop, UV_RUN_ONCE);
	assert_int_equal(authority_revoke(folder, "node", &count, &e), 0);
	assert_int_equal(tls_refresh(listener_tls, &e), 1);
	while (!listener_end.close_count)
		uv_run(&loop, UV_RUN_ONCE);
	assert_int_equal(listener_end.distrust, -EACCES);
	assert_non_null(strstr(listener_end.why, "revoked"));
	close_ends();
	snprintf(list, sizeof list, "%s/farm/crl.pem", folder);
	assert_int_equal(remove(list), 0);
}

/* A peer that is refused because of a date is told apart from one that is refused for good, at the handshake and later.
 */
static void expired_certificate_is_told_from_a_refused_one(void **state)
{
	(void)state;
	char path[128];
	struct error e;
	struct tls *t = caller_tls;
	snprintf(path, sizeof path, "%s/brief", folder);
	assert_int_equal(authority_issue(folder, "brief", TLS_WORKER, 2.0 / 86400, false, &e), 0);
	assert_int_equal(tls_open(&caller_tls, path, &e), 0);
	tls_set_recheck(listener_tls, 0.3);
	for (int i = 0; i < 2; i++) { /* connected while the certificate expires, unless the machine stands still; then
				       * connected too late */
		connect_ends();
		send_bye(&caller_end, 1);
		while (!listener_end.close_count)
			uv_run(&loop, UV_RUN_ONCE);
		assert_int_equal(listener_end.distrust, -EKEYEXPIRED);
		assert_non_null(strstr(listener_end.why, "expired"));
		while (i && !caller_end.close_count)
			uv_run(&loop, UV_RUN_ONCE);
		assert_true(!i || caller_end.distrust == -EKEYEXPIRED);
		close_ends();
	}
	tls_close(caller_tls);
	caller_tls = t;
}

#define COMMON_TESTS                                                                                                \
	cmocka_unit_test(many_frames_do_not_starve_other_sockets), cmocka_unit_test(frames_wait_for_memory),        \
		cmocka_unit_test(frames_go_both_ways), cmocka_unit_test(data_sent_before_a_close_arrives),          \
		cmocka_unit_test(frame_beyond_the_limits_closes_the_connection),                                    \
		cmocka_unit_test(peer_that_does_not_read_is_cut_off),                                               \
		cmocka_unit_test(peer_that_does_not_read_is_cut_off_at_the_shared_limit),                           \
		cmocka_unit_test(incomplete_frame_times_out), cmocka_unit_test(changed_bytes_close_the_connection), \
		cmocka_unit_test(silent_peer_times_out), cmocka_unit_test(slow_frame_counts_as_a_sign_of_life),     \
		cmocka_unit_test(stalled_loop_times_out_no_peer)

int main(void)
{
	const struct CMUnitTest plain[] = {COMMON_TESTS};
	const struct CMUnitTest encrypted[] = {COMMON_TESTS, cmocka_unit_test(one_sided_tls_is_reported_at_both_ends),
					       cmocka_unit_test(silent_handshake_times_out),
					       cmocka_unit_test(revocation_cuts_off_an_open_connection),
					       cmocka_unit_test(expired_certificate_is_told_from_a_refused_one)};
	int failed = cmocka_run_group_tests(plain, set_up_plaintext, NULL);
	return failed + cmocka_run_group_tests(encrypted, set_up_tls, tear_down_tls);
}
