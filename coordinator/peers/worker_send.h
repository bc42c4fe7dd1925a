/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Messages to workers. The size of messages that a worker may send is limited by the largest result of the jobs that
 * it knows, and the bytes that may wait for it to read by the leases that it asked for. If a lease cannot be packed,
 * the connection is closed, and the worker reconnects. The loop's thread.
 */
#ifndef COORDINATOR_PEERS_WORKER_SEND_H
#define COORDINATOR_PEERS_WORKER_SEND_H

#include "coordinator/peers/session.h"

/* Allows the worker to send results of this job, up to its largest size. */
void worker_raise_payload_limit(struct session *p, const struct live_job *job);

/* Each does nothing if the peer is gone. from_seeds: send seeds instead of chain states. */
void worker_send_lease(struct peers *s, uint64_t peer, const struct live_job *job, const struct lease_key *k,
		       bool from_seeds);
void worker_send_revoke(struct peers *s, uint64_t peer, const struct lease_key *k);
void worker_send_ack(struct peers *s, uint64_t peer, const struct lease_key *k, enum ack ack, const char *text);
void worker_send_job_end(struct session *p, uint64_t job);

#endif
