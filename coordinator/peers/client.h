/* SPDX-License-Identifier: Apache-2.0 */
/* A client's side of a session. The loop's thread. */
#ifndef COORDINATOR_PEERS_CLIENT_H
#define COORDINATOR_PEERS_CLIENT_H

#include "coordinator/peers/session.h"

/* Handles a message. May take over the envelope. */
void client_handle_message(struct session *p, struct envelope *env, const unsigned char *payload, size_t size);
void client_tick(struct session *p); /* sends the status of the watched job if it has changed */
/* A file has been checked: continues a submission that waits for it. */
void client_file_checked(struct session *p, const struct blob_hash *h, bool is_intact);
/* Drops the session's submission, if there is one. */
void client_abort_upload(struct session *p);

#endif
