/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What survives the coordinator: jobs in the ledger, merged batches in journals, each flushed before it is
 * acknowledged. Batches that arrive during a flush share the next one (group commit), which runs in the pool. A job
 * whose data the disk refuses is held, and its status says why. It continues without intervention when the disk
 * accepts data again: results that were appended but not flushed are written to a new file (store/journal.h), and an
 * image that could not be written is made again. The loop's thread.
 */
#ifndef COORDINATOR_JOBS_DURABLE_H
#define COORDINATOR_JOBS_DURABLE_H

#include "coordinator/live_job/jobs.h"

/* Stores a new job in the ledger, with an empty journal. When this returns 0, its id may be told to the client. */
int durable_add_job(struct jobs *jobs, struct live_job *job, struct error *e);
/* Packs submission and plan for the ledger; both are mem_alloc'd, and NULL on failure. */
int durable_pack_job(const struct live_job *job, struct ledger_job *j, unsigned char **submission, unsigned char **plan,
		     struct error *e);
/* Records that the job has ended, and keeps (kept_films.h) or deletes its films. Returns an error if the job has a
 * result but its record cannot be written: nobody may be told of the result yet, and the caller tries again. Without a
 * result it returns 0, and durable_tick tries again if necessary. */
int durable_end_job(struct jobs *jobs, struct live_job *job);
/* Records the end of a job whose films are still being read, so that it stays ended if the coordinator is killed
 * before durable_end_job. */
int durable_end_early(struct jobs *jobs, const struct live_job *job, const struct job_record *r, struct error *e);
/* For a job that is no longer live: returns 0, or an error that says why its end is not in the ledger yet. */
int durable_check_ended(const struct jobs *jobs, uint64_t job, struct error *e);
/* Records that a job is over as before, because its extension has failed; now, or as soon as it can be written. */
void durable_restore_end(struct jobs *jobs, const struct job_record *r);

/* Call before the core sees a batch: makes the frame for the journal in `in`, and reserves memory and disk space.
 * Returns -ENOMEM, -ENOSPC or -EFBIG if there is none; the job is then held until there is. */
int durable_reserve_result(struct jobs *jobs, struct live_job *job, struct incoming *in, struct error *e);
/* Call when the core merges the batch: appends it to the journal. *offset: where it is. Returns -ENOMEM if it is not in
 * the journal; it must then not be acknowledged. */
int durable_append_result(struct jobs *jobs, struct live_job *job, const struct incoming *in, uint64_t *offset,
			  struct error *e);
/* Acknowledges a batch that is merged, now or earlier, once the job's journal is on disk. */
void durable_ack(struct jobs *jobs, const struct live_job *job, uint64_t peer, const struct lease_key *k, enum ack ack);
/* Stores the last estimate of the job's error, if it is new. */
void durable_store_look(struct jobs *jobs, uint64_t id);

/* Holds the job because the disk refuses its data. cause: the error. */
void durable_hold_job(struct jobs *jobs, struct live_job *job, const char *consequence, const char *cause);
/* Tries again to store the job's results. Returns 0 if nothing prevents that any more; the job is then released. */
int durable_retry_job(struct jobs *jobs, struct live_job *job);
/* Call regularly: stores counters that have changed, and whatever could not be stored before. */
void durable_tick(struct jobs *jobs);
void durable_close(struct jobs *jobs); /* call after the loop has ended */

#endif
