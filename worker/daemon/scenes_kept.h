/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Which scenes the worker keeps in memory, and for how long. Usually a few stay after their last lease, since more
 * leases of the same job often follow. After memory has run short (work.h) there is one scene at a time. Loop's thread.
 */
#ifndef WORKER_DAEMON_SCENES_KEPT_H
#define WORKER_DAEMON_SCENES_KEPT_H

#include "worker/daemon/agent_state.h"

void scenes_kept_drop(struct agent *a, struct job_cache *b);
/* The first job that is waiting for this file to be fetched; NULL: none is. */
struct job_cache *scenes_kept_who_wants(const struct agent *a, const struct blob_hash *h);
/* Drops unused scenes of jobs that have ended, the least recently used ones beyond WORLDS_KEPT, and fetched files that
 * nobody waits for. Call whenever a scene may have become unused. */
void scenes_kept_tidy(struct agent *a);
/* 0: the job's scene may be in memory now. -EAGAIN: not now, since memory has run short and another scene is in it, or
 * this one has had it for turn_seconds while others waited. If memory has run short, scenes that no lease uses are
 * dropped first. Call for each lease that is granted. */
int scenes_kept_admit(struct agent *a, uint64_t job, struct error *e);
/* Whether an admitted job's scene is not to be built yet: memory has run short, and threads that were told to stop
 * still use another one. */
bool scenes_kept_must_wait(const struct agent *a, const struct job_cache *b);

#endif
