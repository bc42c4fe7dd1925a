/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The coordinator's shell and a worker that names by digest the chain states that it made or refuses: a refusal counts
 * only against the states that it names, and states that do not match their digest are refused before they are stored.
 */
#include "tests/support/served.h"

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
	struct scripted *client, *worker;
	struct grant grant;    /* the last grant */
	bool granted;	       /* a grant has arrived and was not looked at */
	Farm__Verdict verdict; /* the last verdict */
	char text[256];	       /* text of the verdict */
} t;

static int set_up(void **state)
{
	(void)state;
	struct plan_request r = peer_plan_request(NULL);
	struct error e;
	int rc = served_start(60, 60, 60);
	t.granted = false;
	assert_int_equal(plan_make(&r, &t.plan, &e), 0);
	t.client = peer_call();
	t.worker = peer_call();
	assert_true(peer_hello(t.client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	peer_submit(t.client, NULL, "<scene/>", "s.xml", "s.xml");
	assert_int_equal(peer_submit_answer(t.client)->n_missing, 1);
	peer_send_blob(t.client, "<scene/>", "<scene/>");
	assert_int_equal(peer_submit_answer(t.client)->job, 1);
	assert_true(peer_hello(t.worker, FARM_VERSION, FARM__ROLE__ROLE_WORKER)->accepted);
	assert_true(scripted_want(t.worker, 1));
	return rc;
}

static int tear_down(void **state)
{
	grant_fini(&t.grant);
	scripted_hang_up(t.worker);
	scripted_hang_up(t.client);
	return served_stop(state);
}

/* Handles one message. Grants may arrive before the verdict on a result that was sent earlier. */
static void hear_message(void)
{
	struct error e;
	const Farm__Envelope *m = scripted_hear(t.worker);
	assert_non_null(m);
	if (m->body_case == FARM__ENVELOPE__BODY_LEASE_ACK) {
		t.verdict = m->lease_ack->verdict;
		snprintf(t.text, sizeof t.text, "%s", m->lease_ack->text);
	}
	if (m->body_case != FARM__ENVELOPE__BODY_LEASE_GRANT)
		return;
	assert_false(t.granted);
	grant_fini(&t.grant);
	assert_int_equal(grant_unpack(&t.grant, m->lease_grant, t.worker->reader.payload.bytes,
				      t.worker->reader.payload.size, &e),
			 0);
	t.granted = true;
}

static Farm__Verdict hear_verdict(void)
{
	for (t.verdict = FARM__VERDICT__VERDICT_NONE; t.verdict == FARM__VERDICT__VERDICT_NONE;)
		hear_message();
	return t.verdict;
}

static struct batch make_result(uint8_t mark)
{
	struct batch b = scripted_batch(&t.grant.key, &t.plan, STATE_BYTES);
	for (uint32_t i = 0; i < b.state_count; i++)
		b.states[i].bytes[STATE_BYTES - 1] = mark;
	return b;
}

/* Sends a result, whose chain states end with this byte, that is to be merged. */
static void send_merged(uint8_t mark)
{
	struct batch b = make_result(mark);
	peer_send_batch(t.worker, &b, &t.plan);
	batch_fini(&b);
	if (hear_verdict() != FARM__VERDICT__VERDICT_MERGED)
		fail_msg("refused: %s", t.text);
}

static void hear_grant(void)
{
	while (!t.granted)
		hear_message();
	t.granted = false;
}

static void come_to_states(void)
{
	for (hear_grant(); !t.grant.states; hear_grant())
		send_merged(1);
}

/* Answers other leases until this one is granted. */
static void come_to(const struct lease_key *k)
{
	for (hear_grant(); !lease_key_equal(&t.grant.key, k); hear_grant())
		send_merged(1);
}

static void refuse(const struct lease_key *k, const struct blob_hash *states)
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
	peer_say(t.worker, &m, NULL, 0);
}

/* The worker refuses the states of a lease; the epoch that produced them is computed again, with other states, and the
 * lease is given with the new ones. The same refusal, repeated or late, does not count against the new states. */
static void a_refusal_is_of_the_states_that_it_names(void **state)
{
	(void)state;
	come_to_states();
	const struct lease_key k = t.grant.key;
	const struct blob_hash first = t.grant.digest;
	struct lease_key before = k, after = k;
	before.epoch--;
	after.epoch++;
	refuse(&k, &first);
	come_to(&before);
	send_merged(2);
	come_to(&k);
	assert_false(blob_hash_equal(&t.grant.digest, &first));
	assert_int_equal(t.grant.states[0].bytes[STATE_BYTES - 1], 2);
	refuse(&k, &first);
	send_merged(3); /* otherwise it would be refused: its epoch is not open */
	/* The present states can be refused. */
	come_to(&after);
	refuse(&after, &t.grant.digest);
	come_to(&k);
	send_merged(3);
}

/* Sends states that were damaged after the digest was made, or (`without`) that have no digest. */
static void send_damaged(bool without)
{
	struct batch b = make_result(5);
	struct envelope env;
	struct frame_reader r;
	struct error e;
	unsigned char *frame;
	size_t size, used;
	assert_int_equal(batch_pack(&b, &t.plan, &frame, &size, &e), 0);
	batch_fini(&b);
	frame_reader_init(&r, (struct frame_limits){1 << 20, 1 << 24});
	assert_int_equal(frame_reader_take(&r, frame, size, &used, &e), 1);
	assert_int_equal(envelope_unpack(&env, r.header.bytes, r.header.size, &e), 0);
	mem_free(frame);
	Farm__LeaseResult *m = env.message->lease_result;
	size_t tiles = 0;
	for (size_t i = 0; i < m->n_tile_sizes; i++)
		tiles += m->tile_sizes[i];
	if (without)
		m->states_digest.len = 0;
	else
		r.payload.bytes[tiles + STATE_BYTES - 1] ^= 4;
	peer_say(t.worker, env.message, r.payload.bytes, r.payload.size);
	envelope_fini(&env);
	frame_reader_fini(&r);
}

static void states_that_are_not_those_of_their_digest_are_refused(void **state)
{
	(void)state;
	come_to_states();
	const struct lease_key k = t.grant.key;
	send_damaged(false);
	assert_int_equal(hear_verdict(), FARM__VERDICT__VERDICT_REFUSED);
	assert_string_equal(t.text, "the chain states do not match their digest");
	come_to(&k);
	send_damaged(true);
	assert_int_equal(hear_verdict(), FARM__VERDICT__VERDICT_REFUSED);
	assert_string_equal(t.text, "chain states without a digest");
	come_to(&k);
	send_merged(6);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(a_refusal_is_of_the_states_that_it_names, set_up, tear_down),
		cmocka_unit_test_setup_teardown(states_that_are_not_those_of_their_digest_are_refused, set_up,
						tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
