/* SPDX-License-Identifier: Apache-2.0 */
/* Files of jobs that clients fetch. The loop's thread. */
#ifndef COORDINATOR_PEERS_FETCH_H
#define COORDINATOR_PEERS_FETCH_H

#include "coordinator/peers/session.h"

/* Handles a request for a chunk, now or when the preview is ready. */
void fetch_begin(struct session *p, const Farm__Fetch *f);
/* Ends the session's fetch, if there is one. */
void fetch_end(struct session *p);
/* Call when the live job's canvas is free, or the job has ended: sends the preview to the clients that wait for it,
 * or starts making it. */
void fetch_serve_previews(struct peers *s, uint64_t id);
/* Whether a client is fetching the job's result, or waits for it. */
bool fetch_uses_result(const struct peers *s, uint64_t job);

#endif
