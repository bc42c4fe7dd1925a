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
	int messages, closed, drained, partial;
	size_t payload;
	bool garbled, gave_way;
	int distrust;
	struct tls_peer peer; /* the peer, as it was when a message arrived */
	char why[128];
};

static uv_loop_t loop;
static uv_tcp_t listener;
static struct end here, there;
static struct conn_config config;
static struct send_pool *sending; /* NULL: no limit on all connections together */
static char folder[64];
static struct tls *calling, *listening; /* NULL: plaintext */

static void on_message(void *user, struct envelope *env, const unsigned char *payload, size_t size)
{
	struct end *x = user;
	assert_int_equal(env->message->body_case, FARM__ENVELOPE__BODY_BYE);
	for (size_t i = 0; i < size; i++)
		assert_int_equal(payload[i], (unsigned char)(i * 7));
	if (conn_peer(x->conn))
		x->peer = *conn_peer(x->conn);
	x->messages++;
	x->payload += size;
}

static void on_drained(void *user)
{
	((struct end *)user)->drained++;
}

static void on_partial(void *user)
{
	((struct end *)user)->partial++;
}

static void on_closed(void *user, const char *why)
{
	struct end *x = user;
	x->closed++;
	x->distrust = conn_distrust(x->conn);
	x->garbled = conn_garbled(x->conn);
	x->gave_way = conn_gave_way(x->conn);
	x->conn = NULL;
	snprintf(x->why, sizeof x->why, "%s", why);
}

static const struct conn_events events = {
	.message = on_message, .partial = on_partial, .drained = on_drained, .closed = on_closed};

static void on_connection(uv_stream_t *l, int status)
{
	struct error e;
	assert_int_equal(status, 0);
	assert_int_equal(conn_accept(&there.conn, l, &config, &events, &there, &e), 0);
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
	memset(&here, 0, sizeof here);
	memset(&there, 0, sizeof there);
	memset(&bound, 0, sizeof bound);
	config = (struct conn_config){{4096, 1 << 20}, 4 << 20, 0.5, 0, listening, NULL, sending};
	caller = config;
	caller.sending = NULL;
	caller.tls = calling;
	assert_int_equal(uv_loop_init(&loop), 0);
	uv_tcp_init(&loop, &listener);
	assert_int_equal(first_address(&a, "127.0.0.1:0", &e), 0);
	assert_int_equal(uv_tcp_bind(&listener, (struct sockaddr *)&a.storage, 0), 0);
	assert_int_equal(uv_listen((uv_stream_t *)&listener, 8, on_connection), 0);
	assert_int_equal(uv_tcp_getsockname(&listener, (struct sockaddr *)&bound.storage, &length), 0);
	assert_int_equal(conn_connect(&here.conn, &loop, &bound, &caller, &events, &here, &e), 0);
	while (!there.conn)
		uv_run(&loop, UV_RUN_ONCE);
}

static void close_ends(void)
{
	if (here.conn)
		conn_close(here.conn, "test over");
	if (there.conn)
		conn_close(there.conn, "test over");
	uv_close((uv_handle_t *)&listener, NULL);
	uv_run(&loop, UV_RUN_DEFAULT);
	assert_int_equal(uv_loop_close(&loop), 0); /* no handle is left open */
	assert_true(here.closed == 1 && there.closed == 1);
}

static void frames_go_both_ways(void **state)
{
	(void)state;
	connect_ends();
	for (int i = 0; i < 3; i++) {
		send_bye(&here, (size_t)i * 300000);
		send_bye(&there, 1);
	}
	while (there.messages < 3 || here.messages < 3 || !here.drained)
		uv_run(&loop, UV_RUN_ONCE);
	assert_int_equal(there.payload, 900000);
	assert_string_equal(there.peer.name, calling ? "node" : "");
	assert_int_equal(here.peer.role, calling ? TLS_COORDINATOR : TLS_NOBODY);
	conn_close_when_sent(here.conn, "said all");
	while (!there.closed)
		uv_run(&loop, UV_RUN_ONCE);
	assert_string_equal(there.why, "the peer hung up");
	assert_string_equal(here.why, "said all");
	close_ends();
}

static void the_last_words_arrive(void **state)
{
	(void)state;
	connect_ends();
	send_bye(&here, 1 << 20);
	conn_close_when_sent(here.conn, "done");
	send_bye(&here, 1); /* too late: dropped */
	while (!there.closed)
		uv_run(&loop, UV_RUN_ONCE);
	assert_int_equal(there.messages, 1);
	close_ends();
}

static void limits_close(void **state)
{
	(void)state;
	connect_ends();
	send_bye(&here, (1 << 20) + 1);
	while (!there.closed)
		uv_run(&loop, UV_RUN_ONCE);
	assert_non_null(strstr(there.why, "payload"));
	close_ends();
}

static void who_does_not_read_is_cut_off(void **state)
{
	(void)state;
	connect_ends();
	/* The loop does not run in between, so nothing is sent: first the kernel's buffers fill, then the connection's
	 * queue. */
	for (int i = 0; i < 1000 && !here.closed; i++)
		send_bye(&here, 1 << 20);
	while (!here.closed)
		uv_run(&loop, UV_RUN_ONCE);
	assert_non_null(strstr(here.why, "does not read"));
	close_ends();
}

/* The limit over all connections: bytes that a reading peer has taken no longer count, and a peer that does not read is
 * cut off. */
static void all_are_cut_off_together(void **state)
{
	(void)state;
	struct send_pool pool = {.limit = 2 << 20};
	int unread = 0;
	sending = &pool;
	connect_ends();
	sending = NULL;
	for (int i = 1; i <= 8; i++) {
		send_bye(&there, 1 << 20);
		assert_true(pool.used > 1 << 20);
		while (here.messages < i)
			uv_run(&loop, UV_RUN_ONCE);
		for (int k = 0; k < 100 && pool.used; k++)
			uv_run(&loop, UV_RUN_NOWAIT);
		assert_true(pool.used == 0 && there.closed == 0);
	}
	for (; !pool.leaving && unread < 32; unread++)
		send_bye(&there, 1 << 20);
	const uint64_t copied = calling ? 1 << 20 : 0; /* of a frame whose room was reserved before TLS encrypts it */
	assert_true(unread > 1 && unread < 32 && pool.used == 0 && pool.leaving > 1 << 20 &&
		    pool.leaving <= pool.limit + copied);
	while (!there.closed || !here.closed)
		uv_run(&loop, UV_RUN_ONCE);
	assert_true(there.gave_way && pool.used == 0 && pool.leaving == 0 && LIST_EMPTY(&pool.waiting));
	assert_string_equal(there.why, "too much waits to be sent to all peers, and this one does not read its part");
	close_ends();
}

static void half_a_frame_is_not_waited_for(void **state)
{
	(void)state;
	connect_ends();
	unsigned char *half = mem_alloc(11, 1);
	memcpy(half, "\0\0\0\x20\0\0\0\0abc", 11);
	conn_send_bytes(here.conn, half, 11);
	uint64_t begun = uv_hrtime();
	while (!there.closed)
		uv_run(&loop, UV_RUN_ONCE);
	double seconds = (double)(uv_hrtime() - begun) * 1e-9;
	assert_true(seconds > 0.4 && seconds < 60);
	assert_non_null(strstr(there.why, "not completed"));
	close_ends();
}

/* A bit of the second message changes in transit: the connection closes. The first message (in practice a hello) is not
 * protected. */
static void changed_bytes_close(void **state)
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
		unsigned char payload[1000] = {0}, *bytes = checksummed_message(&m, payload, sizeof payload, &size);
		static const size_t places[] = {1, 9, 17, 700}; /* in a length, a checksum, the header, the payload */
		bytes[places[where]] ^= 4;
		connect_ends();
		send_bye(&here, 10);
		unsigned char *copy = mem_alloc(size, 1);
		memcpy(copy, bytes, size);
		conn_send_bytes(here.conn, copy, size);
		while (!there.closed)
			uv_run(&loop, UV_RUN_ONCE);
		assert_true(there.garbled && !there.distrust);
		assert_int_equal(there.messages, 1);
		assert_non_null(strstr(there.why, "changed in transit"));
		close_ends();
		free(bytes);
	}
}

static void silence_is_not_waited_for(void **state)
{
	(void)state;
	connect_ends();
	conn_set_quiet(there.conn, 0.3);
	while (!there.closed)
		uv_run(&loop, UV_RUN_ONCE);
	assert_non_null(strstr(there.why, "silent for too long"));
	close_ends();
}

/* One frame with a payload, sent piece by piece. */
enum { PAYLOAD = 1 << 20, PIECE = PAYLOAD / 16 };

struct drip {
	uv_timer_t timer;
	unsigned char *bytes;
	size_t size, at;
};

static void on_drip(uv_timer_t *t)
{
	struct drip *d = t->data;
	size_t n = d->size - d->at < PIECE ? d->size - d->at : PIECE;
	unsigned char *piece = mem_alloc(n, 1);
	memcpy(piece, d->bytes + d->at, n);
	conn_send_bytes(here.conn, piece, n);
	d->at += n;
	if (d->at == d->size)
		uv_timer_stop(t);
}

/* However many frames a peer has sent, only a few are handled before other sockets are looked at; the peer may send
 * them all and hang up. */
static void many_frames_keep_nobody_waiting(void **state)
{
	(void)state;
	enum { FRAMES = 8000, BYTES = 100, MOST = 16 };
	int before = 0, most = 0;
	connect_ends();
	for (int i = 0; i < FRAMES; i++)
		send_bye(&here, BYTES);
	conn_close_when_sent(here.conn, "said all");
	while (there.messages < FRAMES && !there.closed) {
		uv_run(&loop, UV_RUN_ONCE);
		most = there.messages - before > most ? there.messages - before : most;
		before = there.messages;
	}
	assert_int_equal(there.messages, FRAMES);
	assert_in_range(most, 1, MOST);
	while (!there.closed)
		uv_run(&loop, UV_RUN_ONCE);
	assert_string_equal(there.why, "the peer hung up");
	close_ends();
}

/* While connections that gave way still hold memory, nothing is read that may need more, and frames that were already
 * read wait. */
static void frames_wait_for_memory(void **state)
{
	(void)state;
	enum { FRAMES = 100 };
	struct send_pool pool = {.limit = 1 << 20};
	sending = &pool;
	connect_ends();
	sending = NULL;
	for (int i = 0; i < FRAMES; i++)
		send_bye(&here, 0);
	while (!there.messages)
		uv_run(&loop, UV_RUN_ONCE);
	const int before = there.messages;
	assert_in_range(before, 1, FRAMES - 1);
	pool.leaving = 1;
	for (int i = 0; i < FRAMES; i++)
		uv_run(&loop, UV_RUN_NOWAIT);
	assert_int_equal(there.messages, before);
	pool.leaving = 0;
	while (there.messages < FRAMES)
		uv_run(&loop, UV_RUN_ONCE);
	close_ends();
}

/* The bytes of a slow frame count as signs of life. It is complete after 0.8 s; it may take 16.5 s: half a second plus
 * one for each 64 KB. */
static void a_slow_frame_is_heard(void **state)
{
	(void)state;
	Farm__Bye bye;
	Farm__Envelope m;
	struct drip d = {.at = 0};
	unsigned char *payload = mem_alloc(PAYLOAD, 1);
	for (size_t i = 0; i < PAYLOAD; i++)
		payload[i] = (unsigned char)(i * 7);
	farm__bye__init(&bye);
	farm__envelope__init(&m);
	m.body_case = FARM__ENVELOPE__BODY_BYE;
	m.bye = &bye;
	d.bytes = checksummed_message(&m, payload, PAYLOAD, &d.size);
	connect_ends();
	send_bye(&here, 0);
	while (!there.messages)
		uv_run(&loop, UV_RUN_ONCE);
	assert_int_equal(there.partial, 0); /* no frame was under way */
	conn_set_quiet(there.conn, 0.3);
	d.timer.data = &d;
	uv_timer_init(&loop, &d.timer);
	uv_timer_start(&d.timer, on_drip, 50, 50);
	while (there.messages < 2 && !there.closed)
		uv_run(&loop, UV_RUN_ONCE);
	assert_int_equal(there.messages, 2);
	assert_true(there.partial >= 15);
	uv_close((uv_handle_t *)&d.timer, NULL);
	close_ends();
	free(d.bytes);
	mem_free(payload);
}

/* A peer is not blamed for what was not read: the timeouts for silence and for incomplete frames stand still with the
 * loop. */
static void a_late_reader_waits(void **state)
{
	(void)state;
	connect_ends();
	conn_set_quiet(there.conn, 0.5);
	send_bye(&here, 1000);
	struct timespec stall = {0, 800000000};
	nanosleep(&stall, NULL);
	uv_run(&loop, UV_RUN_ONCE);
	send_bye(&here, 1000);
	while (there.messages < 2 && !there.closed)
		uv_run(&loop, UV_RUN_ONCE);
	assert_int_equal(there.messages, 2);
	close_ends();
}

/* ---- TLS ---- */

static int without_tls(void **state)
{
	(void)state;
	calling = listening = NULL;
	return 0;
}

static int with_tls(void **state)
{
	(void)state;
	char path[128];
	struct error e;
	snprintf(folder, sizeof folder, "/tmp/hslt-net.XXXXXX");
	if (!mkdtemp(folder) || authority_init(folder, "net", 2, &e) ||
	    authority_issue(folder, "farm", TLS_COORDINATOR, 1, false, &e) ||
	    authority_issue(folder, "node", TLS_WORKER, 1, false, &e))
		return -1;
	snprintf(path, sizeof path, "%s/node", folder);
	if (tls_open(&calling, path, &e))
		return -1;
	snprintf(path, sizeof path, "%s/farm", folder);
	return tls_open(&listening, path, &e);
}

static int end_tls(void **state)
{
	(void)state;
	char command[128];
	tls_close(calling);
	tls_close(listening);
	snprintf(command, sizeof command, "rm -rf '%s'", folder);
	return system(command);
}

/* Only the last end to connect speaks, or stays silent, as told: both ends hear what is wrong before the handshake
 * times out. */
static void one_sided(bool caller_speaks)
{
	struct tls *t = caller_speaks ? listening : calling;
	*(caller_speaks ? &listening : &calling) = NULL;
	connect_ends();
	send_bye(&here, 10);
	while (!here.closed || !there.closed)
		uv_run(&loop, UV_RUN_ONCE);
	assert_true(!strstr(here.why, "in time") && !strstr(there.why, "in time"));
	assert_true(here.distrust == -EACCES && there.distrust == -EACCES && !here.messages && !there.messages);
	assert_non_null(strstr(here.why, "TLS"));
	assert_non_null(strstr(there.why, "TLS"));
	close_ends();
	*(caller_speaks ? &listening : &calling) = t;
}

static void only_one_speaks_it(void **state)
{
	(void)state;
	one_sided(true);
	one_sided(false);
}

/* A peer that connects and says nothing, or a byte now and then, has as long as a handshake may take; in this test the
 * clock is the timeout for silence. */
static void silence_is_no_handshake(void **state)
{
	(void)state;
	struct tls *t = calling;
	calling = NULL;
	connect_ends();
	conn_set_quiet(there.conn, 0.3);
	while (!there.closed)
		uv_run(&loop, UV_RUN_ONCE);
	assert_int_equal(there.messages, 0);
	close_ends();
	calling = t;
}

/* A connection whose certificate is no longer valid is cut off while it is open. */
static void a_live_connection_is_checked_again(void **state)
{
	(void)state;
	char list[128];
	unsigned count;
	struct error e;
	connect_ends();
	tls_set_recheck(listening, 0.3);
	send_bye(&here, 1);
	while (!there.messages)
		uv_run(&loop, UV_RUN_ONCE);
	assert_int_equal(authority_revoke(folder, "node", &count, &e), 0);
	assert_int_equal(tls_refresh(listening, &e), 1);
	while (!there.closed)
		uv_run(&loop, UV_RUN_ONCE);
	assert_int_equal(there.distrust, -EACCES);
	assert_non_null(strstr(there.why, "revoked"));
	close_ends();
	snprintf(list, sizeof list, "%s/farm/crl.pem", folder);
	assert_int_equal(remove(list), 0);
}

/* A peer that is refused because of a date is told apart from one that is refused for good, at the handshake and later.
 */
static void a_date_is_told_apart(void **state)
{
	(void)state;
	char path[128];
	struct error e;
	struct tls *t = calling;
	snprintf(path, sizeof path, "%s/brief", folder);
	assert_int_equal(authority_issue(folder, "brief", TLS_WORKER, 2.0 / 86400, false, &e), 0);
	assert_int_equal(tls_open(&calling, path, &e), 0);
	tls_set_recheck(listening, 0.3);
	for (int i = 0; i < 2; i++) { /* connected while the certificate expires, unless the machine stands still; then
				       * connected too late */
		connect_ends();
		send_bye(&here, 1);
		while (!there.closed)
			uv_run(&loop, UV_RUN_ONCE);
		assert_int_equal(there.distrust, -EKEYEXPIRED);
		assert_non_null(strstr(there.why, "expired"));
		while (i && !here.closed)
			uv_run(&loop, UV_RUN_ONCE);
		assert_true(!i || here.distrust == -EKEYEXPIRED);
		close_ends();
	}
	tls_close(calling);
	calling = t;
}

#define EITHER_WAY                                                                                            \
	cmocka_unit_test(many_frames_keep_nobody_waiting), cmocka_unit_test(frames_wait_for_memory),          \
		cmocka_unit_test(frames_go_both_ways), cmocka_unit_test(the_last_words_arrive),               \
		cmocka_unit_test(limits_close), cmocka_unit_test(who_does_not_read_is_cut_off),               \
		cmocka_unit_test(all_are_cut_off_together), cmocka_unit_test(half_a_frame_is_not_waited_for), \
		cmocka_unit_test(changed_bytes_close), cmocka_unit_test(silence_is_not_waited_for),           \
		cmocka_unit_test(a_slow_frame_is_heard), cmocka_unit_test(a_late_reader_waits)

int main(void)
{
	const struct CMUnitTest plain[] = {EITHER_WAY};
	const struct CMUnitTest encrypted[] = {
		EITHER_WAY, cmocka_unit_test(only_one_speaks_it), cmocka_unit_test(silence_is_no_handshake),
		cmocka_unit_test(a_live_connection_is_checked_again), cmocka_unit_test(a_date_is_told_apart)};
	int failed = cmocka_run_group_tests(plain, without_tls, NULL);
	return failed + cmocka_run_group_tests(encrypted, with_tls, end_tls);
}
