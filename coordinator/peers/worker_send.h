/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Messages to workers. What a worker may send is limited by the largest result of the jobs that it knows, and what may
 * wait for it to read by the leases that it asked for. A lease that cannot be packed ends the connection, and the
 * worker reconnects. The loop's thread.
 */
#ifndef COORDINATOR_PEERS_WORKER_SEND_H
#define COORDINATOR_PEERS_WORKER_SEND_H

#include "coordinator/peers/session.h"

/* From now on it may send results of this job, of at most this size. */
void worker_allow_results(struct session *p, const struct live_job *job);

/* Nothing happens if the peer is gone. anew: send seeds. */
void worker_send_lease(struct peers *s, uint64_t peer, const struct live_job *job, const struct lease_key *k,
		       bool anew);
void worker_send_revoke(struct peers *s, uint64_t peer, const struct lease_key *k);
void worker_send_ack(struct peers *s, uint64_t peer, const struct lease_key *k, enum ack ack, const char *text);
void worker_send_job_end(struct session *p, uint64_t job);

#endif
