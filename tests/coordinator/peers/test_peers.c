/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The coordinator against bad peers, over real sockets: bytes that are no messages, too many connections, and peers
 * that never say hello, read nothing, send too slowly or submit invalid jobs. Each is refused or disconnected with a
 * reason, others are served meanwhile, and the coordinator's memory stays bounded.
 */
#include "tests/support/child_server.h"

#include "common/blob/blob.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static int set_up(void **state)
{
	(void)state;
	return child_server_start(60, 60, 60);
}

/* A peer that sends nothing, or half a message, is disconnected after a second. */
static int set_up_quick(void **state)
{
	(void)state;
	return child_server_start(1, 60, 1);
}

static void peer_that_sends_garbage_is_disconnected(void **state)
{
	(void)state;
	static const struct {
		const char *bytes;
		size_t size;
	} rubbish[] = {
		{"GET / HTTP/1.1\r\n\r\n", 18},
		{"\xff\xff\xff\xff\xff\xff\xff\xff", 8},
		{"\0\0\0\0\0\0\0\0", 8},		      /* no header */
		{"\0\0\0\x04\0\0\0\x01", 8},		      /* a payload before hello */
		{"\0\0\x10\x01\0\0\0\0", 8},		      /* 4,097 bytes of hello */
		{"\0\0\0\x03\0\0\0\0\xff\xff\xff", 11},	      /* does not parse */
		{"\0\0\0\x02\0\0\0\0\x1a\x00", 10},	      /* a heartbeat before hello */
		{"\0\0\0\x05\0\0\0\0\x0a\0\x98\x06\x01", 13}, /* an unknown field beside hello */
	};
	for (size_t i = 0; i < sizeof rubbish / sizeof *rubbish; i++) {
		struct scripted_peer *p = child_server_connect();
		child_server_send_bytes(p, rubbish[i].bytes, rubbish[i].size);
		const Farm__Envelope *m = scripted_peer_receive(p);
		if (m) { /* a peer whose message was understood is told what is wrong */
			assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_FAULT);
			assert_null(scripted_peer_receive(p));
		}
		scripted_peer_disconnect(p);
	}
	child_server_check_answers();
}

static void silent_or_slow_peer_is_disconnected(void **state)
{
	(void)state;
	struct scripted_peer *silent = child_server_connect(), *half = child_server_connect(),
			     *client = child_server_connect();
	child_server_send_bytes(half, "\0\0\0\x20", 4);
	assert_true(child_server_exchange_hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	child_server_send_bytes(client, "\0\0\0\x20\0\0\0\0abc", 11); /* a message that is never finished */
	assert_null(scripted_peer_receive(silent));
	assert_null(scripted_peer_receive(half));
	assert_null(scripted_peer_receive(client));
	scripted_peer_disconnect(silent);
	scripted_peer_disconnect(half);
	scripted_peer_disconnect(client);
	child_server_check_answers();
}

static void connections_beyond_the_limit_are_refused(void **state)
{
	(void)state;
	struct scripted_peer *crowd[8];
	for (int i = 0; i < 8; i++) {
		crowd[i] = child_server_connect();
		assert_true(child_server_exchange_hello(crowd[i], FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	}
	struct scripted_peer *one_more = child_server_connect();
	assert_null(scripted_peer_receive(one_more));
	scripted_peer_disconnect(one_more);
	for (int i = 0; i < 8; i++)
		scripted_peer_disconnect(crowd[i]);
	child_server_await_answers();
}

/* Without memory for a connection no peer is accepted; once there is memory, all are. */
static void connection_is_accepted_once_there_is_memory(void **state)
{
	(void)state;
	char path[96];
	snprintf(path, sizeof path, "%s/nomem", child_server_folder());
	assert_int_equal(fclose(fopen(path, "w")), 0);
	while (access(path, F_OK) == 0)
		usleep(1000);
	child_server_check_answers();
	child_server_check_answers();
}

/* When connections run out, peers that have not said hello give way to new ones, the oldest first. */
static void silent_peers_give_way_to_new_ones(void **state)
{
	(void)state;
	struct scripted_peer *first = child_server_connect(), *crowd[7], *guests[7];
	assert_true(child_server_exchange_hello(first, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	for (int i = 0; i < 7; i++)
		crowd[i] = child_server_connect();
	for (int i = 0; i < 7; i++) {
		guests[i] = child_server_connect();
		assert_true(child_server_exchange_hello(guests[i], FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
		assert_null(scripted_peer_receive(crowd[i]));
	}
	struct scripted_peer *one_more = child_server_connect();
	assert_null(scripted_peer_receive(one_more));
	scripted_peer_disconnect(one_more);
	scripted_peer_disconnect(first);
	for (int i = 0; i < 7; i++) {
		scripted_peer_disconnect(crowd[i]);
		scripted_peer_disconnect(guests[i]);
	}
	child_server_await_answers();
}

static void invalid_hello_is_refused(void **state)
{
	(void)state;
	struct scripted_peer *p = child_server_connect();
	const Farm__HelloAck *ack = child_server_exchange_hello(p, FARM_VERSION + 1, FARM__ROLE__ROLE_WORKER);
	assert_false(ack->accepted);
	assert_non_null(strstr(ack->text, "the coordinator is older"));
	assert_null(scripted_peer_receive(p));
	scripted_peer_disconnect(p);
	p = child_server_connect();
	assert_false(child_server_exchange_hello(p, FARM_VERSION, FARM__ROLE__ROLE_NONE)->accepted);
	scripted_peer_disconnect(p);
	p = child_server_connect();
	assert_true(child_server_exchange_hello(p, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	child_server_send_empty(p, FARM__ENVELOPE__BODY_LEASE_REQUEST); /* clients get no leases */
	const Farm__Envelope *m = scripted_peer_receive(p);
	assert_true(m && m->body_case == FARM__ENVELOPE__BODY_FAULT);
	scripted_peer_disconnect(p);
}

static void invalid_submission_is_refused(void **state)
{
	(void)state;
	struct scripted_peer *p = child_server_connect();
	assert_true(child_server_exchange_hello(p, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	static const char *const names[] = {"../s.xml",	 "/s.xml", "a//s.xml", "",
					    "a/./s.xml", "s.xml/", "a/..",     "a\nb"};
	for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
		child_server_submit(p, NULL, "<scene/>", names[i], names[i]);
		const Farm__SubmitAnswer *a = child_server_receive_submit_answer(p);
		assert_true(a->job == 0 && a->n_missing == 0 && *a->refusal);
	}
	child_server_submit(p, NULL, "<scene/>", "other.xml", "s.xml");
	assert_true(*child_server_receive_submit_answer(p)->refusal);
	child_server_submit(p, NULL, "<scene/>", "s.xml", "s.xml");
	assert_int_equal(child_server_receive_submit_answer(p)->n_missing, 1);
	child_server_send_blob(p, "<scene/>", "<SCENE/>"); /* the bytes do not match the hash */
	const Farm__SubmitAnswer *a = child_server_receive_submit_answer(p);
	assert_true(a->job == 0 && *a->refusal);
	child_server_send_blob(p, "<scene/>", "<scene/>"); /* a file that nobody asked for */
	scripted_peer_disconnect(p);
	child_server_check_answers();
}

/* A worker may send the longest chain states that there are: memory must have room for them. */
static void job_with_too_large_chain_states_is_refused(void **state)
{
	(void)state;
	struct scripted_peer *p = child_server_connect();
	struct plan_request r = child_server_plan_request(NULL);
	assert_true(child_server_exchange_hello(p, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	r.max_depth = 128;
	r.chains = 8192;
	assert_true(scripted_peer_submit(p, &r, "<scene/>"));
	const Farm__SubmitAnswer *a = child_server_receive_submit_answer(p);
	assert_true(a->job == 0 && a->n_missing == 0);
	assert_non_null(strstr(a->refusal, "the states of its 8192 chains could need 44.4 MB"));
	assert_non_null(strstr(a->refusal, "the limit is 16.8 MB: fewer --chains, or a smaller --max-depth"));
	r.max_depth = 12; /* 1,776 bytes */
	assert_true(scripted_peer_submit(p, &r, "<scene/>"));
	assert_string_equal(child_server_receive_submit_answer(p)->refusal, "");
	scripted_peer_disconnect(p);
}

/* ---- peers that ask and do not read ---- */

enum { PIECE = 1 << 20 };

/* Returns false if the coordinator hung up. */
static bool send_blob_gets(const struct scripted_peer *p, const struct blob_hash *h, int count)
{
	Farm__Envelope m;
	Farm__BlobGet get;
	struct blob_hash copy = *h;
	farm__envelope__init(&m);
	farm__blob_get__init(&get);
	get.hash = (ProtobufCBinaryData){BLOB_HASH_SIZE, copy.bytes};
	m.body_case = FARM__ENVELOPE__BODY_BLOB_GET;
	m.blob_get = &get;
	for (int i = 0; i < count; i++)
		if (!scripted_peer_send(p, &m, NULL, 0))
			return false;
	return true;
}

/* A worker may ask at once for all files of all its jobs, and gets them. The answers that it does not read do not fill
 * the coordinator's memory, and when it goes on asking it is disconnected. */
static void peers_that_do_not_read_cost_little_memory(void **state)
{
	(void)state;
	struct scripted_peer *client = child_server_connect(), *honest = child_server_connect(), *deaf[4];
	struct blob_hash h;
	struct error e;
	char *scene = malloc(PIECE);
	assert_non_null(scene);
	memset(scene, 'x', PIECE - 1);
	scene[PIECE - 1] = 0;
	assert_int_equal(blob_hash_bytes(scene, PIECE - 1, &h, &e), 0);
	assert_true(child_server_exchange_hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	child_server_submit(client, NULL, scene, "s.xml", "s.xml");
	assert_int_equal(child_server_receive_submit_answer(client)->n_missing, 1);
	child_server_send_blob(client, scene, scene);
	assert_true(child_server_receive_submit_answer(client)->job);
	assert_true(child_server_exchange_hello(honest, FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
	assert_true(send_blob_gets(honest, &h, 64));
	for (int i = 0; i < 64; i++) {
		const Farm__Envelope *m = scripted_peer_receive(honest);
		assert_true(m && m->body_case == FARM__ENVELOPE__BODY_BLOB_CHUNK);
		assert_int_equal(honest->reader.payload.size, PIECE - 1);
	}
	long before = child_server_resident_kilobytes();
	for (int i = 0; i < 4; i++) {
		deaf[i] = child_server_connect();
		assert_true(child_server_exchange_hello(deaf[i], FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
		assert_true(send_blob_gets(deaf[i], &h, 500));
	}
	child_server_check_answers();
	assert_true(child_server_resident_kilobytes() - before <
		    500 * 1024); /* of 2,000 MB that were asked for; a sanitizer keeps up to 256 MB of freed memory */
	for (int i = 0; i < 4; i++) {
		const Farm__Envelope *m;
		/* Too many requests, though the system may buffer 100 MB of answers. */
		send_blob_gets(deaf[i], &h, 1000);
		while ((m = scripted_peer_receive(deaf[i])) && m->body_case == FARM__ENVELOPE__BODY_BLOB_CHUNK)
			continue;
		assert_true(!m || strstr(m->fault->text, "no worker needs so many"));
		scripted_peer_disconnect(deaf[i]);
	}
	free(scene);
	scripted_peer_disconnect(client);
	scripted_peer_disconnect(honest);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(peer_that_sends_garbage_is_disconnected),
		cmocka_unit_test(connections_beyond_the_limit_are_refused),
		cmocka_unit_test(connection_is_accepted_once_there_is_memory),
		cmocka_unit_test(silent_peers_give_way_to_new_ones),
		cmocka_unit_test(invalid_hello_is_refused),
		cmocka_unit_test(invalid_submission_is_refused),
		cmocka_unit_test(job_with_too_large_chain_states_is_refused),
		cmocka_unit_test(peers_that_do_not_read_cost_little_memory),
	};
	const struct CMUnitTest quick[] = {cmocka_unit_test(silent_or_slow_peer_is_disconnected)};
	int failed = cmocka_run_group_tests(tests, set_up, child_server_stop);
	return failed + cmocka_run_group_tests(quick, set_up_quick, child_server_stop);
}
