/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Restores a job of an earlier run from the ledger into a live job, and later into the core; in between its films are
 * read (replay.h). The core is only told which leases are merged: leases that were out return with their workers, or
 * are handed out again.
 */
#ifndef COORDINATOR_JOBS_RESTORE_H
#define COORDINATOR_JOBS_RESTORE_H

#include "coordinator/live_job/jobs.h"

/* 0: its record exists and is valid, or is missing; an error: it cannot be read at the moment. */
int restore_record(const struct jobs *jobs, uint64_t id, struct job_record *r, bool *there, struct error *e);

/* Makes one job from its row. -EBADMSG: something is damaged or missing. */
int restore_live_job(struct jobs *jobs, const struct ledger_job *j, struct live_job **job, struct error *e);
void restore_drop(struct jobs *jobs, struct live_job *job); /* and releases its files */
/* The sentence for the status. */
const char *restore_held_by(const char *who, char text[256]);
/* Tells the core of a live job in the list. held: who holds it, or "". tag: of the peer that
 * asked for it; 0: it continues after a restart. -EPERM: the core refuses, only with a tag; -ENOMEM. */
int restore_tell(struct jobs *jobs, const struct live_job *job, const char *held, uint64_t tag, struct error *e);

#endif
