/* SPDX-License-Identifier: Apache-2.0 */
/* Parts that several answers to clients share. The loop's thread. */
#ifndef COORDINATOR_PEERS_CLIENT_ANSWERS_H
#define COORDINATOR_PEERS_CLIENT_ANSWERS_H

#include "coordinator/peers/session.h"

/* Whether the client may see the job: with a certificate a client sees only its own jobs, an operator sees all. Other
 * jobs are reported as missing, because an answer that they exist would already reveal something. Removes texts about
 * others' jobs from the view. */
bool client_may_see(const struct session *p, struct job_view *v);
/* Returns false if there is no such job, or the client may not see it. */
bool client_find_job(const struct session *p, uint64_t job, struct job_view *v);
/* Sends a Done. refusal: the reason; NULL: the request was fulfilled. text: what was done, or "". */
void client_send_done(struct session *p, const char *refusal, const char *text);
/* Returns how many bytes of scene files other connections of the same owner are sending. */
uint64_t client_uploading_bytes(const struct session *p);

#endif
