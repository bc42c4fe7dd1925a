/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Restores a job of an earlier run from the ledger into a live job, and later into the core; in between its films are
 * read (replay.h). The core is told only which leases are merged: leases that were out return with their workers, or
 * are handed out again.
 */
#ifndef COORDINATOR_JOBS_RESTORE_H
#define COORDINATOR_JOBS_RESTORE_H

#include "coordinator/live_job/jobs.h"

/* Reads a job's record. *exists: it exists and is valid. Returns an error if it cannot be read at the moment; 0 if it
 * is missing or damaged. */
int restore_record(const struct jobs *jobs, uint64_t id, struct job_record *r, bool *exists, struct error *e);

/* Makes a live job from a row. Returns -EBADMSG if something is damaged or missing, -EPROTO if another version wrote
 * it. */
int restore_live_job(struct jobs *jobs, const struct ledger_job *j, struct live_job **job, struct error *e);
void restore_drop_job(struct jobs *jobs, struct live_job *job); /* frees it and releases its files */
/* Writes the sentence that the status shows for a held job. */
const char *restore_hold_text(const char *holder, char text[256]);
/* Tells the core of a job in the list of live jobs. holder: who holds it, or "". tag: the peer that requested its
 * extension; 0: it continues after a restart. Returns -EPERM if the core refuses, which needs a tag; -ENOMEM. */
int restore_tell_core(struct jobs *jobs, const struct live_job *job, const char *holder, uint64_t tag, struct error *e);

#endif
