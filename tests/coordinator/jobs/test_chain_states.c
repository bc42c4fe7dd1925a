/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The coordinator's shell and a worker that names by digest the chain states that it made or refuses: a refusal counts
 * only against the states that it names, and states that do not match their digest are refused before they are stored.
 */
#include "tests/support/child_server.h"

#include "common/base/mem.h"
#include "tests/support/checksummed_frame.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <stdio.h>

enum { STATE_BYTES = 16 };

static struct fixture {
	struct plan plan;
	struct scripted_peer *client, *worker;
	struct grant grant;    /* the last grant */
	bool has_grant;	       /* a grant has arrived and was not looked at */
	Farm__Verdict verdict; /* the last verdict */
	char text[256];	       /* text of the verdict */
} fixture;

static int set_up(void **state)
{
	(void)state;
	struct plan_request r = child_server_plan_request(NULL);
	struct error e;
	int rc = child_server_start(60, 60, 60);
	fixture.has_grant = false;
	assert_int_equal(plan_make(&r, &fixture.plan, &e), 0);
	fixture.client = child_server_connect();
	fixture.worker = child_server_connect();
	assert_true(child_server_exchange_hello(fixture.client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	child_server_submit(fixture.client, NULL, "<scene/>", "s.xml", "s.xml");
	assert_int_equal(child_server_receive_submit_answer(fixture.client)->n_missing, 1);
	child_server_send_blob(fixture.client, "<scene/>", "<scene/>");
	assert_int_equal(child_server_receive_submit_answer(fixture.client)->job, 1);
	assert_true(child_server_exchange_hello(fixture.worker, FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
	assert_true(scripted_peer_request_leases(fixture.worker, 1));
	return rc;
}

static int tear_down(void **state)
{
	grant_fini(&fixture.grant);
	scripted_peer_disconnect(fixture.worker);
	scripted_peer_disconnect(fixture.client);
	return child_server_stop(state);
}

/* Handles one message. Grants may arrive before the verdict on a result that was sent earlier. */
static void hear_message(void)
{
	struct error e;
	const Farm__Envelope *m = scripted_peer_receive(fixture.worker);
	assert_non_null(m);
	if (m->body_case == FARM__ENVELOPE__BODY_LEASE_ACK) {
		fixture.verdict = m->lease_ack->verdict;
		snprintf(fixture.text, sizeof fixture.text, "%s", m->lease_ack->text);
	}
	if (m->body_case != FARM__ENVELOPE__BODY_LEASE_GRANT)
		return;
	assert_false(fixture.has_grant);
	grant_fini(&fixture.grant);
	assert_int_equal(grant_unpack(&fixture.grant, m->lease_grant, fixture.worker->reader.payload.bytes,
				      fixture.worker->reader.payload.size, &e),
			 0);
	fixture.has_grant = true;
}

static Farm__Verdict hear_verdict(void)
{
	for (fixture.verdict = FARM__VERDICT__VERDICT_NONE; fixture.verdict == FARM__VERDICT__VERDICT_NONE;)
		hear_message();
	return fixture.verdict;
}

static struct batch make_result(uint8_t mark)
{
	struct batch b = scripted_peer_make_batch(&fixture.grant.key, &fixture.plan, STATE_BYTES);
	for (uint32_t i = 0; i < b.state_count; i++)
		b.states[i].bytes[STATE_BYTES - 1] = mark;
	return b;
}

/* Sends a result, whose chain states end with this byte, that is to be merged. */
static void send_merged(uint8_t mark)
{
	struct batch b = make_result(mark);
	child_server_send_batch(fixture.worker, &b, &fixture.plan);
	batch_fini(&b);
	if (hear_verdict() != FARM__VERDICT__VERDICT_MERGED)
		fail_msg("refused: %s", fixture.text);
}

static void hear_grant(void)
{
	while (!fixture.has_grant)
		hear_message();
	fixture.has_grant = false;
}

static void await_grant_with_states(void)
{
	for (hear_grant(); !fixture.grant.states; hear_grant())
		send_merged(1);
}

/* Answers other leases until this one is granted. */
static void await_grant_of(const struct lease_key *k)
{
	for (hear_grant(); !lease_key_equal(&fixture.grant.key, k); hear_grant())
		send_merged(1);
}

static void send_refusal(const struct lease_key *k, const struct blob_hash *states)
{
	Farm__LeaseKey key;
	Farm__LeaseFailed failed;
	Farm__Envelope m;
	struct blob_hash copy = *states;
	char text[] = "it does not resume";
	farm__lease_failed__init(&failed);
	farm__envelope__init(&m);
	lease_key_to_wire(k, &key);
	failed.key = &key;
	failed.text = text;
	failed.bad_states = true;
	failed.states_digest = (ProtobufCBinaryData){sizeof copy.bytes, copy.bytes};
	m.body_case = FARM__ENVELOPE__BODY_LEASE_FAILED;
	m.lease_failed = &failed;
	child_server_send(fixture.worker, &m, NULL, 0);
}

/* The worker refuses the states of a lease; the epoch that produced them is computed again, with other states, and the
 * lease is given with the new ones. The same refusal, repeated or late, does not count against the new states. */
static void refusal_counts_only_against_the_states_it_names(void **state)
{
	(void)state;
	await_grant_with_states();
	const struct lease_key k = fixture.grant.key;
	const struct blob_hash first = fixture.grant.digest;
	struct lease_key before = k, after = k;
	before.epoch--;
	after.epoch++;
	send_refusal(&k, &first);
	await_grant_of(&before);
	send_merged(2);
	await_grant_of(&k);
	assert_false(blob_hash_equal(&fixture.grant.digest, &first));
	assert_int_equal(fixture.grant.states[0].bytes[STATE_BYTES - 1], 2);
	send_refusal(&k, &first);
	send_merged(3); /* otherwise it would be refused: its epoch is not open */
	/* The present states can be refused. */
	await_grant_of(&after);
	send_refusal(&after, &fixture.grant.digest);
	await_grant_of(&k);
	send_merged(3);
}

/* Sends states that were damaged after the digest was made, or (`without_digest`) that have no digest. */
static void send_damaged_states(bool without_digest)
{
	struct batch b = make_result(5);
	struct envelope env;
	struct frame_reader r;
	struct error e;
	unsigned char *frame;
	size_t size, used;
	assert_int_equal(batch_pack(&b, &fixture.plan, &frame, &size, &e), 0);
	batch_fini(&b);
	frame_reader_init(&r, (struct frame_limits){1 << 20, 1 << 24});
	assert_int_equal(frame_reader_feed(&r, frame, size, &used, &e), 1);
	assert_int_equal(envelope_unpack(&env, r.header.bytes, r.header.size, &e), 0);
	mem_free(frame);
	Farm__LeaseResult *m = env.message->lease_result;
	size_t tiles = 0;
	for (size_t i = 0; i < m->n_tile_sizes; i++)
		tiles += m->tile_sizes[i];
	if (without_digest)
		m->states_digest.len = 0;
	else
		r.payload.bytes[tiles + STATE_BYTES - 1] ^= 4;
	child_server_send(fixture.worker, env.message, r.payload.bytes, r.payload.size);
	envelope_fini(&env);
	frame_reader_fini(&r);
}

static void states_that_do_not_match_their_digest_are_refused(void **state)
{
	(void)state;
	await_grant_with_states();
	const struct lease_key k = fixture.grant.key;
	send_damaged_states(false);
	assert_int_equal(hear_verdict(), FARM__VERDICT__VERDICT_REFUSED);
	assert_string_equal(fixture.text, "the chain states do not match their digest");
	await_grant_of(&k);
	send_damaged_states(true);
	assert_int_equal(hear_verdict(), FARM__VERDICT__VERDICT_REFUSED);
	assert_string_equal(fixture.text, "chain states without a digest");
	await_grant_of(&k);
	send_merged(6);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(refusal_counts_only_against_the_states_it_names, set_up, tear_down),
		cmocka_unit_test_setup_teardown(states_that_do_not_match_their_digest_are_refused, set_up, tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
