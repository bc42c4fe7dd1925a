/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Decides which scenes the worker keeps in memory, and for how long. Usually a few stay after their last lease, since
 * more leases of the same job often follow. For some time after memory has run short (crash_record.h), only one scene
 * at a time is in memory. The loop's thread.
 */
#ifndef WORKER_DAEMON_SCENE_LIMIT_H
#define WORKER_DAEMON_SCENE_LIMIT_H

#include "worker/daemon/agent_state.h"

void scene_limit_drop(struct agent *a, struct job_cache *cache); /* removes and frees a job */
/* Returns the first job that waits for this file; NULL if none does. */
struct job_cache *scene_limit_find_waiting(const struct agent *a, const struct blob_hash *h);
/* Drops unused scenes of jobs that have ended or failed, the least recently used ones beyond IDLE_WORLDS_MAX, and
 * fetches that no job wants. Call whenever a scene may have become unused. */
void scene_limit_drop_unused(struct agent *a);
/* Call for each lease that is granted. Returns 0 if the job's scene may be in memory now; -EAGAIN if memory has run
 * short, and another scene is in memory or this one has been for turn_seconds while others waited. If memory has run
 * short, scenes that are not in use are dropped first. */
int scene_limit_admit(struct agent *a, uint64_t job, struct error *e);
/* Returns whether the scene of an admitted job must not be built yet: memory has run short, and threads that have been
 * told to stop still use another scene. */
bool scene_limit_must_wait(const struct agent *a, const struct job_cache *cache);

#endif
