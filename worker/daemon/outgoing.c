/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/daemon/outgoing.h"

#include "common/base/log.h"
#include "common/base/mem.h"
#include "common/base/text.h"

#include <string.h>

void send_message(struct agent *a, const Farm__Envelope *m)
{
	if (a->conn && a->welcome)
		conn_send(a->conn, m, NULL, 0);
}

void send_request(struct agent *a)
{
	Farm__LeaseRequest request;
	Farm__Envelope m;
	farm__lease_request__init(&request);
	farm__envelope__init(&m);
	request.want = a->leaving || a->backlog ? 0 : a->config.threads + 1;
	m.body_case = FARM__ENVELOPE__BODY_LEASE_REQUEST;
	m.lease_request = &request;
	send_message(a, &m);
}

void send_job_get(struct agent *a, uint64_t job)
{
	Farm__JobGet get;
	Farm__Envelope m;
	farm__job_get__init(&get);
	farm__envelope__init(&m);
	get.job = job;
	m.body_case = FARM__ENVELOPE__BODY_JOB_GET;
	m.job_get = &get;
	send_message(a, &m);
}

/* states: their digest; NULL: they are not at fault. */
static void send_failure(struct agent *a, const struct lease_key *k, const char *text, bool own,
			 const struct blob_hash *states)
{
	char copy[1024];
	struct blob_hash digest;
	Farm__LeaseKey key;
	Farm__LeaseFailed failed;
	Farm__Envelope m;
	lease_key_to_wire(k, &key);
	farm__lease_failed__init(&failed);
	farm__envelope__init(&m);
	text_copy(copy, sizeof copy, text);
	text_clean(copy);
	failed.key = &key;
	failed.text = copy;
	failed.own = own;
	failed.bad_states = states != NULL;
	if (states) {
		digest = *states;
		failed.states_digest = (ProtobufCBinaryData){sizeof digest.bytes, digest.bytes};
	}
	m.body_case = FARM__ENVELOPE__BODY_LEASE_FAILED;
	m.lease_failed = &failed;
	send_message(a, &m);
	if (*text)
		log_event(LOG_LEASE_FAILED, "job=j%llu kind=%s group=%u part=%u epoch=%llu text=%s", log_u64(k->job),
			  lease_kind_name(k->kind), k->group, k->part, log_u64(k->epoch), log_quote(text).text);
}

void send_failed(struct agent *a, const struct lease_key *k, const char *text, bool own)
{
	send_failure(a, k, text, own, NULL);
}

void send_bad_states(struct agent *a, const struct grant *g, const char *text)
{
	send_failure(a, &g->key, text, false, &g->digest);
}

void send_result(struct agent *a, struct lease_task *l)
{
	if (!a->conn || !a->welcome || l->sent || !l->bundle->confirmed)
		return;
	unsigned char *copy = mem_alloc(l->frame_size, 1);
	if (!copy) { /* sent again after the next connect */
		conn_close(a->conn, "no memory to send a result");
		return;
	}
	memcpy(copy, l->frame, l->frame_size);
	conn_send_frame(a->conn, copy, l->frame_size);
	l->sent = true;
}
