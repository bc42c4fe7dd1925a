/* SPDX-License-Identifier: Apache-2.0 */
/* What all answers to a client share. The loop's thread. */
#ifndef COORDINATOR_PEERS_CLIENT_ANSWERS_H
#define COORDINATOR_PEERS_CLIENT_ANSWERS_H

#include "coordinator/peers/session.h"

/* With a certificate a client sees only its own jobs, an operator all. Other jobs are reported as missing, because
 * to say that they exist would be an answer, too. Texts about others' jobs are removed from the view. */
bool client_may_see(const struct session *p, struct job_view *v);
/* false: no such job for this client. */
bool client_finds_job(const struct session *p, uint64_t job, struct job_view *v);
/* refusal: the reason; NULL: it is done. text: what was done, or "". */
void client_send_done(struct session *p, const char *refusal, const char *text);
/* Bytes of scenes that other connections of the same owner are sending. */
uint64_t client_uploading(const struct session *p);

#endif
