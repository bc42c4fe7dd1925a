/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What is kept of a finished job: for extensions (jobs/extend.h) its films (the last checkpoint and the journal after
 * it) and its submission in the ledger; for lists its record. If all films together exceed the limit, those of the
 * jobs that ended first are deleted; if a running job needs room, all films are. Results stay. The loop's thread.
 */
#ifndef COORDINATOR_RETENTION_KEPT_FILMS_H
#define COORDINATOR_RETENTION_KEPT_FILMS_H

#include "coordinator/live_job/jobs.h"

/* Whether the films of a job that has just ended are to be kept. false: the job cannot be extended. */
bool kept_films_are_wanted(const struct jobs *jobs, const struct live_job *job, const struct job_record *r);
/* Deletes a job's films and its submission, unless the films are being read. */
void kept_films_drop(const struct jobs *jobs, uint64_t job);
/* Returns in *bytes the size of a job's films. Returns false if its folder could not be read, which is logged. */
bool kept_films_get_bytes(const struct jobs *jobs, uint64_t job, uint64_t *bytes);
bool kept_films_drop_all(const struct jobs *jobs); /* deletes the films of all listed jobs; true: some were deleted */
/* Deletes films beyond the limit; call after jobs have ended, and at the start. */
void kept_films_trim(const struct jobs *jobs);

/* Reads the records of the last ENDED_JOBS_MAX jobs that ended, in the order of their ends. A record that cannot be
 * read is logged and skipped. */
int ended_jobs_open(struct jobs *jobs, struct error *e);
void ended_jobs_add(struct jobs *jobs, const struct job_record *r); /* adds a job that has ended */
void ended_jobs_remove(struct jobs *jobs, uint64_t job); /* removes a job that continues or has been cleared */
struct job_record *ended_jobs_find(const struct jobs *jobs, uint64_t job); /* NULL: not in the list */

#endif
