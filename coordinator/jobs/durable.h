/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What survives the coordinator: its jobs in the ledger, their merged batches in journals, each flushed before it is
 * acknowledged. Batches that come while a flush is under way share the next one (group commit), which runs in the pool.
 * A job that the disk fails is held, says why, and goes on by itself: what it appended meanwhile and what was not
 * flushed is brought into a new file (store/journal.h), an image that could not be written is made again. The loop's
 * thread.
 */
#ifndef COORDINATOR_JOBS_DURABLE_H
#define COORDINATOR_JOBS_DURABLE_H

#include "coordinator/job/jobs.h"

/* The job is in the ledger when this returns, with an empty journal: it may be told to whoever submitted it. */
int durable_begin(struct jobs *jobs, struct live_job *job, struct error *e);
/* Submission and plan as the ledger takes them; the two are mem_alloc'd, and NULL if they could not be made. */
int durable_pack(const struct live_job *job, struct ledger_job *j, unsigned char **submission, unsigned char **plan,
		 struct error *e);
/* It has ended: its record is written, its films are kept (keep.h) or go. Not 0: its record cannot be written, and it
 * has a result, which nobody must be told of yet. Records of others are tried again. */
int durable_end(struct jobs *jobs, struct live_job *job);
/* A job's record says that it has ended: so does the ledger then, or when it can be written again. */
void durable_end_row(struct jobs *jobs, const struct job_record *r);

/* Before the core sees the batch: the frame for the journal, into `in`, and room on the disk for it. -ENOSPC,
 * -EFBIG: the disk is full: the job is held until there is room. */
int durable_reserve(struct jobs *jobs, struct live_job *job, struct incoming *in, struct error *e);
/* The core merges the batch. -ENOMEM: the journal has it not, and it must not be acknowledged. */
int durable_merged(struct jobs *jobs, struct live_job *job, const struct incoming *in, uint64_t *at, struct error *e);
/* The answer to a batch that is merged, by now or before, when what the job's journal holds is safe. */
void durable_ack(struct jobs *jobs, const struct live_job *job, uint64_t peer, const struct lease_key *k, enum ack ack);
/* The last look at the job's error, if it is new. */
void durable_look(struct jobs *jobs, uint64_t job);

/* What the disk did not take is tried again from time to time, and the text says what that is. */
void durable_hold(struct jobs *jobs, struct live_job *job, const char *what, const char *why);
/* 0: nothing stands in the way of its results any more, and it goes on. */
int durable_mend(struct jobs *jobs, struct live_job *job);
/* Now and then: counters, what went wrong with a job since, and ends of jobs that could not be written. */
void durable_tick(struct jobs *jobs);
void durable_close(struct jobs *jobs); /* after the loop */

#endif
