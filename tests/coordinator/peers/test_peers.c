/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The coordinator against bad peers, over real sockets: bytes that are no messages, too many connections, and peers
 * that never say hello, read nothing, send too slowly or submit invalid jobs. Each is refused or disconnected with a
 * reason, others are served meanwhile, and the coordinator's memory stays bounded.
 */
#include "tests/support/served.h"

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
	return served_start(60, 60, 60);
}

/* A peer that sends nothing, or half a message, is disconnected after a second. */
static int set_up_quick(void **state)
{
	(void)state;
	return served_start(1, 60, 1);
}

static void rubbish_is_disconnected(void **state)
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
		struct scripted *p = peer_call();
		peer_say_bytes(p, rubbish[i].bytes, rubbish[i].size);
		const Farm__Envelope *m = scripted_hear(p);
		if (m) { /* a peer whose message was understood is told what is wrong */
			assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_FAULT);
			assert_null(scripted_hear(p));
		}
		scripted_hang_up(p);
	}
	served_still_works();
}

static void stragglers_are_disconnected(void **state)
{
	(void)state;
	struct scripted *silent = peer_call(), *half = peer_call(), *client = peer_call();
	peer_say_bytes(half, "\0\0\0\x20", 4);
	assert_true(peer_hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	peer_say_bytes(client, "\0\0\0\x20\0\0\0\0abc", 11); /* a message that is never finished */
	assert_null(scripted_hear(silent));
	assert_null(scripted_hear(half));
	assert_null(scripted_hear(client));
	scripted_hang_up(silent);
	scripted_hang_up(half);
	scripted_hang_up(client);
	served_still_works();
}

static void crowds_are_turned_away(void **state)
{
	(void)state;
	struct scripted *crowd[8];
	for (int i = 0; i < 8; i++) {
		crowd[i] = peer_call();
		assert_true(peer_hello(crowd[i], FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	}
	struct scripted *one_more = peer_call();
	assert_null(scripted_hear(one_more));
	scripted_hang_up(one_more);
	for (int i = 0; i < 8; i++)
		scripted_hang_up(crowd[i]);
	served_works_again();
}

/* Without memory for a connection no peer is accepted; once there is memory, all are. */
static void a_caller_waits_for_memory(void **state)
{
	(void)state;
	char path[96];
	snprintf(path, sizeof path, "%s/nomem", served_folder());
	assert_int_equal(fclose(fopen(path, "w")), 0);
	while (access(path, F_OK) == 0)
		usleep(1000);
	served_still_works();
	served_still_works();
}

/* When connections run out, peers that have not said hello give way to new ones, the oldest first. */
static void the_silent_give_way(void **state)
{
	(void)state;
	struct scripted *first = peer_call(), *crowd[7], *guests[7];
	assert_true(peer_hello(first, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	for (int i = 0; i < 7; i++)
		crowd[i] = peer_call();
	for (int i = 0; i < 7; i++) {
		guests[i] = peer_call();
		assert_true(peer_hello(guests[i], FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
		assert_null(scripted_hear(crowd[i]));
	}
	struct scripted *one_more = peer_call();
	assert_null(scripted_hear(one_more));
	scripted_hang_up(one_more);
	scripted_hang_up(first);
	for (int i = 0; i < 7; i++) {
		scripted_hang_up(crowd[i]);
		scripted_hang_up(guests[i]);
	}
	served_works_again();
}

static void hello_is_looked_at(void **state)
{
	(void)state;
	struct scripted *p = peer_call();
	const Farm__HelloAck *ack = peer_hello(p, FARM_VERSION + 1, FARM__ROLE__ROLE_WORKER);
	assert_false(ack->accepted);
	assert_non_null(strstr(ack->text, "the coordinator is older"));
	assert_null(scripted_hear(p));
	scripted_hang_up(p);
	p = peer_call();
	assert_false(peer_hello(p, FARM_VERSION, FARM__ROLE__ROLE_NONE)->accepted);
	scripted_hang_up(p);
	p = peer_call();
	assert_true(peer_hello(p, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	peer_say_empty(p, FARM__ENVELOPE__BODY_LEASE_REQUEST); /* clients get no leases */
	const Farm__Envelope *m = scripted_hear(p);
	assert_true(m && m->body_case == FARM__ENVELOPE__BODY_FAULT);
	scripted_hang_up(p);
}

static void submissions_are_looked_at(void **state)
{
	(void)state;
	struct scripted *p = peer_call();
	assert_true(peer_hello(p, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	static const char *const names[] = {"../s.xml",	 "/s.xml", "a//s.xml", "",
					    "a/./s.xml", "s.xml/", "a/..",     "a\nb"};
	for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
		peer_submit(p, NULL, "<scene/>", names[i], names[i]);
		const Farm__SubmitAnswer *a = peer_submit_answer(p);
		assert_true(a->job == 0 && a->n_missing == 0 && *a->refusal);
	}
	peer_submit(p, NULL, "<scene/>", "other.xml", "s.xml");
	assert_true(*peer_submit_answer(p)->refusal);
	peer_submit(p, NULL, "<scene/>", "s.xml", "s.xml");
	assert_int_equal(peer_submit_answer(p)->n_missing, 1);
	peer_send_blob(p, "<scene/>", "<SCENE/>"); /* the bytes do not match the hash */
	const Farm__SubmitAnswer *a = peer_submit_answer(p);
	assert_true(a->job == 0 && *a->refusal);
	peer_send_blob(p, "<scene/>", "<scene/>"); /* a file that nobody asked for */
	scripted_hang_up(p);
	served_still_works();
}

/* A worker may send the longest chain states that there are: memory must have room for them. */
static void chains_need_memory(void **state)
{
	(void)state;
	struct scripted *p = peer_call();
	struct plan_request r = peer_plan_request(NULL);
	assert_true(peer_hello(p, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	r.max_depth = 128;
	r.chains = 8192;
	assert_true(scripted_submit(p, &r, "<scene/>"));
	const Farm__SubmitAnswer *a = peer_submit_answer(p);
	assert_true(a->job == 0 && a->n_missing == 0);
	assert_non_null(strstr(a->refusal, "the states of its 8192 chains could need 44.4 MB"));
	assert_non_null(strstr(a->refusal, "the limit is 16.8 MB: fewer --chains, or a smaller --max-depth"));
	r.max_depth = 12; /* 1,776 bytes */
	assert_true(scripted_submit(p, &r, "<scene/>"));
	assert_string_equal(peer_submit_answer(p)->refusal, "");
	scripted_hang_up(p);
}

/* ---- peers that ask and do not read ---- */

enum { PIECE = 1 << 20 };

/* Returns false if the coordinator hung up. */
static bool say_piece_gets(const struct scripted *p, const struct blob_hash *h, int count)
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
		if (!scripted_say(p, &m, NULL, 0))
			return false;
	return true;
}

/* A worker may ask at once for all files of all its jobs, and gets them. The answers that it does not read do not fill
 * the coordinator's memory, and when it goes on asking it is disconnected. */
static void the_deaf_cost_little(void **state)
{
	(void)state;
	struct scripted *client = peer_call(), *honest = peer_call(), *deaf[4];
	struct blob_hash h;
	struct error e;
	char *scene = malloc(PIECE);
	assert_non_null(scene);
	memset(scene, 'x', PIECE - 1);
	scene[PIECE - 1] = 0;
	assert_int_equal(blob_hash_bytes(scene, PIECE - 1, &h, &e), 0);
	assert_true(peer_hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	peer_submit(client, NULL, scene, "s.xml", "s.xml");
	assert_int_equal(peer_submit_answer(client)->n_missing, 1);
	peer_send_blob(client, scene, scene);
	assert_true(peer_submit_answer(client)->job);
	assert_true(peer_hello(honest, FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
	assert_true(say_piece_gets(honest, &h, 64));
	for (int i = 0; i < 64; i++) {
		const Farm__Envelope *m = scripted_hear(honest);
		assert_true(m && m->body_case == FARM__ENVELOPE__BODY_BLOB_CHUNK);
		assert_int_equal(honest->reader.payload.size, PIECE - 1);
	}
	long before = served_kilobytes();
	for (int i = 0; i < 4; i++) {
		deaf[i] = peer_call();
		assert_true(peer_hello(deaf[i], FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
		assert_true(say_piece_gets(deaf[i], &h, 500));
	}
	served_still_works();
	assert_true(served_kilobytes() - before <
		    500 * 1024); /* of 2,000 MB that were asked for; a sanitizer keeps up to 256 MB of freed memory */
	for (int i = 0; i < 4; i++) {
		const Farm__Envelope *m;
		say_piece_gets(deaf[i], &h,
			       1000); /* too many requests, though the system may buffer 100 MB of answers */
		while ((m = scripted_hear(deaf[i])) && m->body_case == FARM__ENVELOPE__BODY_BLOB_CHUNK)
			continue;
		assert_true(!m || strstr(m->fault->text, "no worker needs so many"));
		scripted_hang_up(deaf[i]);
	}
	free(scene);
	scripted_hang_up(client);
	scripted_hang_up(honest);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(rubbish_is_disconnected),   cmocka_unit_test(crowds_are_turned_away),
		cmocka_unit_test(a_caller_waits_for_memory), cmocka_unit_test(the_silent_give_way),
		cmocka_unit_test(hello_is_looked_at),	     cmocka_unit_test(submissions_are_looked_at),
		cmocka_unit_test(chains_need_memory),	     cmocka_unit_test(the_deaf_cost_little),
	};
	const struct CMUnitTest quick[] = {cmocka_unit_test(stragglers_are_disconnected)};
	int failed = cmocka_run_group_tests(tests, set_up, served_stop);
	return failed + cmocka_run_group_tests(quick, set_up_quick, served_stop);
}
