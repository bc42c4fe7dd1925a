/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/peers/worker_send.h"

#include "common/base/text.h"

void worker_raise_payload_limit(struct session *p, const struct live_job *job)
{
	uint32_t need = batch_payload_max(&job->plan);
	if (need > p->payload_limit) {
		p->payload_limit = need;
		conn_set_limits(p->conn, (struct frame_limits){SESSION_HEADER_MAX, need});
	}
}

/* Raises the send limit so that as many of the largest leases as the worker wants may wait for it to read. */
static void raise_send_limit(struct session *p, size_t size)
{
	struct peer_status s;
	if (!farm_peer_status(p->jobs->farm, p->id, &s) || s.wanted_leases * size <= p->max_lease_bytes)
		return;
	p->max_lease_bytes = s.wanted_leases * size;
	conn_set_send_limit(p->conn, SESSION_SEND_MAX + p->max_lease_bytes);
}

void worker_send_lease(struct peers *s, uint64_t peer, const struct live_job *job, const struct lease_key *k,
		       bool from_seeds)
{
	unsigned char *frame;
	size_t size;
	struct error e;
	struct session *p = peers_find_session(s, peer);
	if (!p)
		return;
	worker_raise_payload_limit(p, job);
	if (live_job_pack_lease(job, k, from_seeds, &frame, &size, &e)) {
		conn_close(p->conn, e.text);
		return;
	}
	raise_send_limit(p, size);
	conn_send_frame(p->conn, frame, size);
}

void worker_send_revoke(struct peers *s, uint64_t peer, const struct lease_key *k)
{
	Farm__LeaseKey key;
	const struct session *p = peers_find_session(s, peer);
	lease_key_to_wire(k, &key);
	if (p)
		conn_send(p->conn, ENVELOPE(LEASE_REVOKE, lease_revoke, .key = &key), NULL, 0);
}

void worker_send_ack(struct peers *s, uint64_t peer, const struct lease_key *k, enum ack ack, const char *text)
{
	static const Farm__Verdict verdicts[] = {[ACK_MERGED] = FARM__VERDICT__VERDICT_MERGED,
						 [ACK_REPEATED] = FARM__VERDICT__VERDICT_REPEATED,
						 [ACK_REFUSED] = FARM__VERDICT__VERDICT_REFUSED,
						 [ACK_NOTED] = FARM__VERDICT__VERDICT_NOTED};
	char copy[512];
	Farm__LeaseKey key;
	const struct session *p = peers_find_session(s, peer);
	lease_key_to_wire(k, &key);
	text_copy(copy, sizeof copy, text);
	if (p)
		conn_send(p->conn, ENVELOPE(LEASE_ACK, lease_ack, .key = &key, .verdict = verdicts[ack], .text = copy),
			  NULL, 0);
}

void worker_send_job_end(struct session *p, uint64_t job)
{
	conn_send(p->conn, ENVELOPE(JOB_END, job_end, .job = job), NULL, 0);
}
