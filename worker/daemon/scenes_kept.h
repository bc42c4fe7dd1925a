/* SPDX-License-Identifier: Apache-2.0 */
/* Which scenes the worker keeps in memory, and for how long. Loop's thread. */
#ifndef WORKER_DAEMON_SCENES_KEPT_H
#define WORKER_DAEMON_SCENES_KEPT_H

#include "worker/daemon/agent_state.h"

void scenes_kept_drop(struct agent *a, struct job_cache *b);
struct job_cache *scenes_kept_who_wants(const struct agent *a,
					const struct blob_hash *h); /* first to fetch it; or NULL */
/* Drops unused scenes of jobs that have ended, the least recently used ones beyond WORLDS_KEPT, and files that nobody
 * waits for. */
void scenes_kept_tidy(struct agent *a);
/* Where memory has not been enough, scenes are in it one at a time: the others that no lease uses are dropped. The job
 * that stays, of several in use the first; next: if none is in use; may be NULL. */
struct job_cache *scenes_kept_one(struct agent *a, struct job_cache *next);

#endif
