/* SPDX-License-Identifier: Apache-2.0 */
/* What all answers to a client need. The loop's thread. */
#ifndef COORDINATOR_PEERS_CLIENT_ANSWERS_H
#define COORDINATOR_PEERS_CLIENT_ANSWERS_H

#include "coordinator/peers/session.h"

/* Whoever has a certificate sees the own jobs alone, an operator all. Jobs of others are not there: that they are would
 * be an answer, too. What others' jobs would tell in it is taken out of the view. */
bool client_may_see(const struct session *p, struct job_view *v);
/* false: no such job for this client. */
bool client_finds_job(const struct session *p, uint64_t job, struct job_view *v);
void client_send_done(struct session *p, const char *text); /* p->rejected says why not; text: what was done, or "" */
/* Bytes of the scenes that others of the same owner are sending. */
uint64_t client_uploading(const struct session *p);

#endif
