/* SPDX-License-Identifier: Apache-2.0 */
/* A worker's side of a session. The loop's thread. */
#ifndef COORDINATOR_PEERS_WORKER_H
#define COORDINATOR_PEERS_WORKER_H

#include "coordinator/peers/session.h"

/* What it says. May take the envelope. */
void worker_message(struct session *p, struct envelope *env);
void worker_heard(struct session *p); /* a part of a message that is still coming */

/* Results of this job may come from now on, and they may be so long. */
void worker_allow_results(struct session *p, const struct live_job *o);

/* What it is told. anew: with seeds. */
void worker_send_lease(struct session *p, const struct live_job *o, const struct lease_key *k, bool anew);
void worker_send_revoke(struct session *p, const struct lease_key *k);
void worker_send_ack(struct session *p, const struct lease_key *k, enum ack ack, const char *text);
void worker_send_job_end(struct session *p, uint64_t job);

#endif
