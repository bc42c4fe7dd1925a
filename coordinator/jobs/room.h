/* SPDX-License-Identifier: Apache-2.0 */
/* Room on the spool's disk for what running jobs have to store. The loop's thread. */
#ifndef COORDINATOR_JOBS_ROOM_H
#define COORDINATOR_JOBS_ROOM_H

#include "coordinator/job/jobs.h"

/* The disk is full: deletes something that no job needs, first a scene file, then the films of finished jobs. false:
 * there is nothing left. */
bool room_make(const struct jobs *jobs);
/* Whether the journals of all running jobs can grow to their limits, and a checkpoint be written then. */
bool room_is_ample(const struct jobs *jobs);
/* Bytes of a job's journal beyond which a checkpoint replaces it: the limit that was set, or as many as the checkpoint
 * has; where room is not ample, as many as the checkpoint has. */
uint64_t room_for_journal(const struct jobs *jobs, const struct live_job *job, bool ample);
/* Whether a checkpoint can still be written after so many bytes: it is what makes room again, once the journal is
 * longer than the checkpoint. */
bool room_is_left(const struct jobs *jobs, const struct live_job *job, uint64_t bytes);

#endif
