/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job of an earlier run, from the ledger into a live job and from there into the core; its films come in between
 * (replay.h). The core is told which leases are merged and no more: what was out when the coordinator stopped comes
 * back with its worker, or is handed out again.
 */
#ifndef COORDINATOR_JOBS_RESTORE_H
#define COORDINATOR_JOBS_RESTORE_H

#include "coordinator/job/jobs.h"

int restore_open(struct jobs *jobs, struct error *e);	   /* the ledger */
bool restore_lives(const struct jobs *jobs, uint64_t job); /* it had not ended */
/* 0: its record is there, and whole, or not; what cannot be read just now is an error. */
int restore_record(const struct jobs *jobs, uint64_t id, struct job_record *r, bool *there, struct error *e);

/* One job from its row, for nobody yet. -EBADMSG: something of it is damaged or gone. */
int restore_live_job(struct jobs *jobs, const struct ledger_job *j, struct live_job **job, struct error *e);
void restore_drop(struct jobs *jobs, struct live_job *job); /* and lets go of its files */
/* The sentence for the status. */
const char *restore_held_by(const char *who, char text[256]);
/* The core is told of a live job that is in the jobs' list. held: by whom, or "". Refusals carry the tag. */
int restore_tell(struct jobs *jobs, const struct live_job *job, const char *held, uint64_t tag, struct error *e);

#endif
