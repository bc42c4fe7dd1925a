/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Files of scenes in spool/blobs, which may be damaged while they lie there: they are checked before they are given to
 * anybody. A job of which one is gone or damaged waits and says which; whoever submits the scene again brings it, and
 * the job goes on. No worker is blamed for it. The loop's thread.
 */
#ifndef COORDINATOR_JOBS_FILES_H
#define COORDINATOR_JOBS_FILES_H

#include "coordinator/job/jobs.h"

enum { FILES_CHECKED = 60 /* s: what was right so lately is not read again before it is given to anybody */ };

/* Of one that is asked for. Not 0: it cannot be given; jobs that need it wait. */
int files_check(struct jobs *jobs, const struct blob_hash *h, double seconds, struct error *e);
/* Whether a job has all its files, by what the store knows; it waits or goes on. */
bool files_look(struct jobs *jobs, struct live_job *job);
/* All of a job's, when a worker complains: read again unless that was done after a piece was given out last. false: it
 * waits for one. */
bool files_are_right(struct jobs *jobs, struct live_job *job);
void files_tick(struct jobs *jobs); /* those that wait for files that are here now go on */

#endif
