/* SPDX-License-Identifier: Apache-2.0 */
/* Room on the spool's disk, and in memory, for the data of live jobs. The loop's thread. */
#ifndef COORDINATOR_JOBS_STORAGE_H
#define COORDINATOR_JOBS_STORAGE_H

#include "coordinator/live_job/jobs.h"

/* Call when the disk is full: deletes something that no job needs, first a scene file, then the films of finished
 * jobs. Returns false if there is nothing left to delete. */
bool storage_evict(const struct jobs *jobs);
/* Checks whether a job that needs this many bytes can ever be stored, counting what is free now and what will be once
 * scene files, the films of finished jobs and other live jobs are gone. Returns -ENOSPC if it cannot; 0 also if that
 * cannot be known, because jobs are still being read or a folder of the spool cannot be. */
int storage_check_fits(const struct jobs *jobs, uint64_t bytes, struct error *e);
/* Whether there is room for the journals of all live jobs to grow to their limits, and for a checkpoint after that. */
bool storage_is_ample(const struct jobs *jobs);

/* The bytes that a job may have to write until a checkpoint has replaced its journal. */
struct storage_claim {
	uint64_t job, bytes;
	int priority;
	bool may_write; /* set by storage_grant_claims: the job may write */
};
/* Decides which jobs may write. Several jobs may each fit on the disk and yet fill it together until none can write
 * its checkpoint, although only a checkpoint makes room again. So a job goes on only if its claim fits beside the
 * claims of the jobs before it that go on; jobs of higher priority come first, then older jobs. If no claim fits, the
 * first job goes on, since it may need less. Sorts the claims. */
void storage_grant_claims(struct storage_claim *claims, size_t count, uint64_t available);
/* Returns the job for which this one must wait by the rule of storage_grant_claims, among all from which results may
 * come; 0: it may write. */
uint64_t storage_find_write_blocker(const struct jobs *jobs, const struct live_job *job);
/* Decides whether a job's chain states may grow. They are in memory until the job ends, also while it is held, and
 * one job may need up to state_bytes for them. So a job's states may grow only while the states of all other jobs
 * together take at most half of state_bytes. Jobs that need little, at most 1/32 of it, do not wait for jobs that
 * need much: a quarter of state_bytes is reserved for them, and does not count for others. However many jobs there
 * are, their states never take more than 7/4 of state_bytes, and one job can always go on: the last one whose states
 * grew by the first rule. after: bytes of the job's states once they have grown. Returns 0 if they may grow,
 * otherwise the job with the largest states. */
enum { STORAGE_SMALL_JOB_DIVISOR = 32, STORAGE_SMALL_RESERVE_DIVISOR = 4 };
uint64_t storage_find_states_blocker(const struct jobs *jobs, const struct live_job *job, uint64_t after);
/* Returns the length of the job's journal beyond which a checkpoint replaces it: the configured limit or, if that is
 * larger, the size of the checkpoint; the size of the checkpoint if room is not ample. */
uint64_t storage_journal_limit(const struct jobs *jobs, const struct live_job *job, bool ample);
/* Whether a checkpoint can still be written after `bytes` more in the journal. This matters once the journal is
 * longer than the checkpoint, because then only a checkpoint makes room again. */
bool storage_fits_checkpoint(const struct jobs *jobs, const struct live_job *job, uint64_t bytes);

#endif
