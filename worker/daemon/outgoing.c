/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/daemon/outgoing.h"

#include "common/base/log.h"
#include "common/base/mem.h"
#include "common/base/text.h"

#include <string.h>

void send_message(struct agent *a, const Farm__Envelope *m)
{
	if (a->conn && a->is_accepted)
		conn_send(a->conn, m, NULL, 0);
}

void send_lease_request(struct agent *a)
{
	uint32_t wanted_leases = a->is_leaving || a->has_backlog ? 0 : a->config.threads + 1;
	send_message(a, ENVELOPE(LEASE_REQUEST, lease_request, .want = wanted_leases));
}

void send_job_get(struct agent *a, uint64_t job)
{
	send_message(a, ENVELOPE(JOB_GET, job_get, .job = job));
}

/* Who is at fault for a failed lease: the job, this machine, or nobody (another scene is in memory). */
enum fault_party { FAULT_JOB, FAULT_WORKER, FAULT_NONE };

/* states: digest of the chain states that could not be used; NULL: they are not at fault. */
static void send_failure(struct agent *a, const struct lease_key *k, const char *text, enum fault_party fault,
			 const struct blob_hash *states)
{
	char copy[1024];
	struct blob_hash digest;
	Farm__LeaseKey key;
	lease_key_to_wire(k, &key);
	text_copy(copy, sizeof copy, text);
	text_clean(copy);
	Farm__LeaseFailed failed = MESSAGE(lease_failed, .key = &key, .text = copy, .own = fault != FAULT_JOB,
					   .later = fault == FAULT_NONE, .bad_states = states != NULL);
	if (states) {
		digest = *states;
		failed.states_digest = (ProtobufCBinaryData){sizeof digest.bytes, digest.bytes};
	}
	send_message(a, ENVELOPE_OF(LEASE_FAILED, lease_failed, &failed));
	if (*text && fault != FAULT_NONE)
		log_event(LOG_LEASE_FAILED, "job=j%llu " LEASE_FORMAT " text=%s", log_u64_arg(k->job), LEASE_VALUES(k),
			  log_quote(text).text);
}

void send_lease_failed(struct agent *a, const struct lease_key *k, const char *text, bool worker_at_fault)
{
	send_failure(a, k, text, worker_at_fault ? FAULT_WORKER : FAULT_JOB, NULL);
}

void send_lease_deferred(struct agent *a, const struct lease_key *k, const char *text)
{
	send_failure(a, k, text, FAULT_NONE, NULL);
}

void send_bad_states(struct agent *a, const struct grant *g, const char *text)
{
	send_failure(a, &g->key, text, FAULT_JOB, &g->digest);
}

void send_result(struct agent *a, struct lease_task *l)
{
	if (!a->conn || !a->is_accepted || l->is_sent || !l->job_cache->is_confirmed)
		return;
	unsigned char *copy = mem_alloc(l->frame_size, 1);
	if (!copy) { /* the result will be sent on the next connection */
		conn_close(a->conn, "no memory to send a result");
		return;
	}
	memcpy(copy, l->frame, l->frame_size);
	conn_send_frame(a->conn, copy, l->frame_size);
	l->is_sent = true;
}
