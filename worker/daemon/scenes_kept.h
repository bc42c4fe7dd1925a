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
/* Whether the job's scene may be in memory now. Where that has not been enough (work.h) one scene is in it at a time,
 * and the others that no lease uses are dropped; if other jobs wait, it makes way after a while. -EAGAIN: not now. */
int scenes_kept_admit(struct agent *a, uint64_t job, struct error *e);

#endif
