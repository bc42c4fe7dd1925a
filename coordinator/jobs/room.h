/* SPDX-License-Identifier: Apache-2.0 */
/* Room on the spool's disk, and in memory, for what running jobs have to store. The loop's thread. */
#ifndef COORDINATOR_JOBS_ROOM_H
#define COORDINATOR_JOBS_ROOM_H

#include "coordinator/live_job/jobs.h"

/* The disk is full: deletes something that no job needs, first a scene file, then the films of finished jobs. false:
 * there is nothing left. */
bool room_make(const struct jobs *jobs);
/* Whether a job can ever be stored that needs so many bytes: given what is free, and what will be once the files of
 * scenes, the films of finished jobs and other running jobs are gone. -ENOSPC; 0 also where it cannot be known yet,
 * while jobs are read, or a folder of the spool cannot be. */
int room_could_hold(const struct jobs *jobs, uint64_t bytes, struct error *e);
/* Whether the journals of all running jobs can grow to their limits, and a checkpoint be written then. */
bool room_is_ample(const struct jobs *jobs);

/* What a job may have to write until a checkpoint has replaced its journal. */
struct room_claim {
	uint64_t job, bytes;
	int priority;
	bool goes; /* filled in: it may write */
};
/* Several jobs may fit on the disk one by one, and together fill it until none can write its checkpoint, which is what
 * makes room again. So a job goes on only if its claim fits beside those of the jobs before it that go on: jobs of
 * higher priority, and older ones. If none fits, the first goes on, and may need less. Sorts them. */
void room_share(struct room_claim *claims, size_t count, uint64_t available);
/* The job for which this one must wait by that rule, among all from which results may come; 0: it may write. */
uint64_t room_first(const struct jobs *jobs, const struct live_job *job);
/* Chain states are in memory until their job ends, also while it is held, and one job may need up to state_bytes for
 * them. So a job's states may grow only while those of all others together have at most half of that. Jobs that need
 * little, at most 1/32, do not wait for those that need much: a quarter is theirs apart, and counts for nobody else.
 * However many jobs there are, they never have more than 7/4 of state_bytes, and there is always one that can go on:
 * the last whose states grew by the first rule. `after`: bytes of the job's states once they have grown. Returns the
 * job that has most of those which leave no room; 0: they may grow. */
enum { ROOM_SMALL_JOB = 32, ROOM_SMALL_JOBS = 4 };
uint64_t room_for_states(const struct jobs *jobs, const struct live_job *job, uint64_t after);
/* Bytes of a job's journal beyond which a checkpoint replaces it: the limit that was set, or as many as the checkpoint
 * has; where room is not ample, as many as the checkpoint has. */
uint64_t room_for_journal(const struct jobs *jobs, const struct live_job *job, bool ample);
/* Whether a checkpoint can still be written after that many more bytes: once the journal is longer than the checkpoint,
 * only that makes room again. */
bool room_is_left(const struct jobs *jobs, const struct live_job *job, uint64_t bytes);

#endif
