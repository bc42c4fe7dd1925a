/* SPDX-License-Identifier: Apache-2.0 */
/* One message without its frame: the parser, and everything that is made from its content (plans, requests, keys,
 * grants). */
#include "common/wire/batch_wire.h"
#include "tests/fuzz/messages.h"
#include "common/plan/plan_text.h"

#include <string.h>

static void exercise_plan(const Farm__Plan *m)
{
	struct plan p;
	struct error e;
	char text[PLAN_TEXT_MAX];
	if (!m || plan_from_wire(m, &p, &e))
		return;
	Farm__Plan out;
	plan_to_wire(&p, &out);
	plan_describe(&p, text, sizeof text);
	batch_payload_max(&p);
	chain_states_payload_max(&p);
}

static void exercise_request(const Farm__PlanRequest *m)
{
	struct plan_request r;
	struct plan p;
	struct error e;
	char text[PLAN_TEXT_MAX];
	if (!m || plan_request_from_wire(m, &r, &e) || plan_make(&r, &p, &e))
		return;
	plan_describe(&p, text, sizeof text);
}

static void exercise_key(const Farm__LeaseKey *m)
{
	struct lease_key k;
	struct error e;
	Farm__LeaseKey out;
	if (lease_key_from_wire(m, &k, &e) == 0)
		lease_key_to_wire(&k, &out);
}

static void exercise_message(const Farm__Envelope *m)
{
	struct grant g;
	struct error e;
	switch (m->body_case) {
	case FARM__ENVELOPE__BODY_HELLO:
		envelope_text_is_valid(m->hello->name, 127);
		break;
	case FARM__ENVELOPE__BODY_JOB_INFO:
		exercise_plan(m->job_info->plan);
		break;
	case FARM__ENVELOPE__BODY_SUBMIT:
		exercise_request(m->submit->plan);
		break;
	case FARM__ENVELOPE__BODY_LEASE_GRANT:
		if (grant_unpack(&g, m->lease_grant, NULL, 0, &e) == 0)
			grant_fini(&g);
		break;
	case FARM__ENVELOPE__BODY_LEASE_RESULT:
		exercise_key(m->lease_result->key);
		break;
	case FARM__ENVELOPE__BODY_LEASE_ACK:
		exercise_key(m->lease_ack->key);
		break;
	case FARM__ENVELOPE__BODY_LEASE_FAILED:
		exercise_key(m->lease_failed->key);
		break;
	case FARM__ENVELOPE__BODY_LEASE_REVOKE:
		exercise_key(m->lease_revoke->key);
		break;
	default:
		break;
	}
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
	struct envelope env;
	struct error e;
	if (envelope_unpack(&env, bytes, size, &e))
		return 0;
	exercise_message(env.message);
	envelope_fini(&env);
	return 0;
}

size_t LLVMFuzzerCustomMutator(uint8_t *bytes, size_t size, size_t max_size, unsigned seed)
{
	return message_mutate(bytes, size, max_size, seed);
}
