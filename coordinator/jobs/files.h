/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Files of scenes in spool/blobs, which may get damaged: they are checked before they are sent to anyone. A job with a
 * missing or damaged file waits and names it; submitting the scene again repairs it, and the job continues. No worker
 * is blamed. The loop's thread.
 */
#ifndef COORDINATOR_JOBS_FILES_H
#define COORDINATOR_JOBS_FILES_H

#include "coordinator/job/jobs.h"

enum { FILES_CHECKED = 60 /* s: a file checked so recently is not read again before it is sent */ };

/* Checks a file that is requested. Not 0: it cannot be sent; the jobs that need it wait. */
int files_check(struct jobs *jobs, const struct blob_hash *h, double seconds, struct error *e);
/* Checks whether the store has all of a job's files; it waits or continues. Any job may be gone afterwards. */
void files_look(struct jobs *jobs, struct live_job *job);
/* Checks all of a job's files when a worker complains: reads them again unless that was done after the last chunk
 * was sent. false: it waits for one, and may be gone. */
bool files_are_right(struct jobs *jobs, const struct live_job *job);
void files_tick(struct jobs *jobs); /* jobs that wait for files which exist now continue */

#endif
