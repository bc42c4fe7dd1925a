/* SPDX-License-Identifier: Apache-2.0 */
/* A client's side of a session. The loop's thread. */
#ifndef COORDINATOR_PEERS_CLIENT_H
#define COORDINATOR_PEERS_CLIENT_H

#include "coordinator/peers/session.h"

/* What it says. May take the envelope. */
void client_message(struct session *p, struct envelope *env, const unsigned char *payload, size_t size);
void client_tick(struct session *p); /* what has changed of the job that it watches */
void client_upload_abort(struct session *p);

/* false: no such job for this client, who sees the own jobs alone. */
bool client_finds_job(const struct session *p, uint64_t job, struct job_view *v);
void client_send_done(struct session *p, const char *text); /* p->rejected says why not; text: what was done, or "" */
/* Bytes of the scenes that others of the same owner are sending. */
uint64_t client_uploading(const struct session *p);

#endif
