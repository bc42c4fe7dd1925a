/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What survives the coordinator: jobs in the ledger, merged batches in journals, each flushed before it is
 * acknowledged. Batches that arrive during a flush share the next one (group commit), which runs in the pool. A job
 * whose data the disk refuses is held, and its status says why. It continues by itself when the disk takes data again:
 * results that were appended but not flushed are written to a new file (store/journal.h), and an image that could not
 * be written is made again. The loop's thread.
 */
#ifndef COORDINATOR_JOBS_DURABLE_H
#define COORDINATOR_JOBS_DURABLE_H

#include "coordinator/live_job/jobs.h"

/* When this returns the job is in the ledger, with an empty journal: its number may be told to the client. */
int durable_begin(struct jobs *jobs, struct live_job *job, struct error *e);
/* Submission and plan for the ledger; both are mem_alloc'd, and NULL on failure. */
int durable_pack(const struct live_job *job, struct ledger_job *j, unsigned char **submission, unsigned char **plan,
		 struct error *e);
/* The job has ended: writes its record, and keeps (keep.h) or deletes its films. Not 0: it has a result, but its record
 * cannot be written, and nobody may be told of it yet. Without a result the record is tried again by durable_tick. */
int durable_end(struct jobs *jobs, struct live_job *job);
/* The job has ended, but its films are being read: writes this record, so that it stays ended if the coordinator is
 * killed before durable_end. */
int durable_end_soon(struct jobs *jobs, const struct live_job *job, const struct job_record *r, struct error *e);
/* 0, or why the end of the job, which is live no more, is not in the ledger yet. */
int durable_ended(const struct jobs *jobs, uint64_t job, struct error *e);
/* An extension has failed, and the job is over as before: writes that now, or as soon as it can be written. */
void durable_end_again(struct jobs *jobs, const struct job_record *r);

/* Before the core sees a batch: prepares the frame for the journal, in `in`, and room in memory and on the disk.
 * -ENOMEM, -ENOSPC, -EFBIG: there is none, and the job is held until there is. */
int durable_reserve(struct jobs *jobs, struct live_job *job, struct incoming *in, struct error *e);
/* The core merges the batch: appends it. -ENOMEM: the journal does not have it, and it must not be acknowledged. */
int durable_merged(struct jobs *jobs, struct live_job *job, const struct incoming *in, uint64_t *at, struct error *e);
/* Sends the answer to a batch that is merged, now or earlier, once the job's journal is on disk. */
void durable_ack(struct jobs *jobs, const struct live_job *job, uint64_t peer, const struct lease_key *k, enum ack ack);
/* Stores the last estimate of the job's error, if it is new. */
void durable_look(struct jobs *jobs, uint64_t job);

/* Retries from time to time what the disk refused; the text says what that is. */
void durable_hold(struct jobs *jobs, struct live_job *job, const char *what, const char *why);
/* 0: nothing prevents storing its results any more, and it continues. */
int durable_mend(struct jobs *jobs, struct live_job *job);
/* Called now and then: stores counters that have changed, and what could not be stored before. */
void durable_tick(struct jobs *jobs);
void durable_close(struct jobs *jobs); /* after the loop */

#endif
