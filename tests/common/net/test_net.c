/* Addresses are read strictly; connections carry frames both ways, tell once that they end, and never grow without bound. */
#include "common/base/mem.h"
#include "common/net/conn.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void addresses(void **state)
{
	(void)state;
	struct net_addr a;
	struct error e;
	static const char *const bad[] = {"", "localhost", ":1", "127.0.0.1:", "127.0.0.1:x", "127.0.0.1:65536", "::1:80",
					  "127.0.0.1:-1", "127.0.0.1:1 ", "[]:1"};
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
		assert_int_equal(net_addr_resolve(&a, bad[i], &e), -EINVAL);
	assert_int_equal(net_addr_resolve(&a, "127.3.2.1:80", &e), 0);
	assert_true(net_addr_is_loopback(&a) && net_addr_port(&a) == 80);
	assert_int_equal(net_addr_resolve(&a, "[::1]:7700", &e), 0);
	assert_true(net_addr_is_loopback(&a) && net_addr_port(&a) == 7700);
	assert_int_equal(net_addr_allow(&a, "[::1]:7700", false, &e), 0);
	static const char *const far[] = {"0.0.0.0:1", "192.0.2.1:1", "[::]:1", "[2001:db8::1]:1"};
	for (size_t i = 0; i < sizeof far / sizeof *far; i++) {
		char text[80];
		assert_int_equal(net_addr_resolve(&a, far[i], &e), 0);
		assert_int_equal(net_addr_allow(&a, far[i], false, &e), -EPERM);
		assert_non_null(strstr(e.text, "--insecure"));
		assert_int_equal(net_addr_allow(&a, far[i], true, &e), 0);
		net_addr_format(&a, text, sizeof text);
		assert_string_equal(text, far[i]);
	}
}

/* ---- two ends on one loop ---- */

struct end {
	struct conn *conn;
	int messages, closed, drained;
	size_t payload;
	char why[128];
};

static uv_loop_t loop;
static uv_tcp_t listener;
static struct end here, there;
static struct conn_config config;

static void on_message(void *user, struct envelope *env, const unsigned char *payload, size_t size)
{
	struct end *x = user;
	assert_int_equal(env->message->body_case, FARM__ENVELOPE__BODY_BYE);
	for (size_t i = 0; i < size; i++)
		assert_int_equal(payload[i], (unsigned char)(i * 7));
	x->messages++;
	x->payload += size;
}

static void on_drained(void *user)
{
	((struct end *)user)->drained++;
}

static void on_closed(void *user, const char *why)
{
	struct end *x = user;
	x->closed++;
	x->conn = NULL;
	snprintf(x->why, sizeof x->why, "%s", why);
}

static const struct conn_events events = {NULL, on_message, on_drained, on_closed};

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
	memset(&here, 0, sizeof here);
	memset(&there, 0, sizeof there);
	memset(&bound, 0, sizeof bound);
	config = (struct conn_config){{4096, 1 << 20}, 4 << 20, 0.5, 0, NULL};
	assert_int_equal(uv_loop_init(&loop), 0);
	uv_tcp_init(&loop, &listener);
	assert_int_equal(net_addr_resolve(&a, "127.0.0.1:0", &e), 0);
	assert_int_equal(uv_tcp_bind(&listener, (struct sockaddr *)&a.storage, 0), 0);
	assert_int_equal(uv_listen((uv_stream_t *)&listener, 8, on_connection), 0);
	assert_int_equal(uv_tcp_getsockname(&listener, (struct sockaddr *)&bound.storage, &length), 0);
	assert_int_equal(conn_connect(&here.conn, &loop, &bound, &config, &events, &here, &e), 0);
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
	assert_int_equal(uv_loop_close(&loop), 0); /* nothing is left open */
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
	/* The loop does not run in between, so nothing is taken: the kernel's buffers fill, then ours. */
	for (int i = 0; i < 1000 && !here.closed; i++)
		send_bye(&here, 1 << 20);
	while (!here.closed)
		uv_run(&loop, UV_RUN_ONCE);
	assert_non_null(strstr(here.why, "does not take"));
	close_ends();
}

static void half_a_frame_is_not_waited_for(void **state)
{
	(void)state;
	connect_ends();
	unsigned char *half = mem_alloc(11, 1);
	memcpy(half, "\0\0\0\x20\0\0\0\0abc", 11);
	conn_send_frame(here.conn, half, 11);
	uint64_t begun = uv_hrtime();
	while (!there.closed)
		uv_run(&loop, UV_RUN_ONCE);
	double seconds = (double)(uv_hrtime() - begun) * 1e-9;
	assert_true(seconds > 0.4 && seconds < 5);
	assert_non_null(strstr(there.why, "not finished"));
	close_ends();
}

static void silence_is_not_waited_for(void **state)
{
	(void)state;
	connect_ends();
	conn_set_quiet(there.conn, 0.3);
	while (!there.closed)
		uv_run(&loop, UV_RUN_ONCE);
	assert_non_null(strstr(there.why, "nothing was heard"));
	close_ends();
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(addresses),		    cmocka_unit_test(frames_go_both_ways),
		cmocka_unit_test(the_last_words_arrive),    cmocka_unit_test(limits_close),
		cmocka_unit_test(who_does_not_read_is_cut_off), cmocka_unit_test(half_a_frame_is_not_waited_for),
		cmocka_unit_test(silence_is_not_waited_for),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
