/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Files of scenes in spool/blobs, which may get damaged: they are checked before they are sent to anyone. A job with a
 * missing or damaged file waits and names it; submitting the scene again repairs it, and the job continues. No worker
 * is blamed. The loop's thread; the files are read by the pool, one at a time, and whoever needs one waits for it.
 */
#ifndef COORDINATOR_JOBS_FILES_H
#define COORDINATOR_JOBS_FILES_H

#include "coordinator/live_job/jobs.h"

enum { FILES_CHECKED = 60 /* s: a file checked so recently is not read again before it is sent */ };

/* Checks a file that is requested or submitted. -EINPROGRESS: it is being read, and the answer is file_read of
 * peer_calls.h. Other errors: it cannot be sent; the jobs that lack it wait. */
int files_check(struct jobs *jobs, const struct blob_hash *h, struct error *e);
/* Checks whether the store has all of a job's files; it waits or continues. true: a step was made, after which any job
 * may be gone. */
bool files_look(struct jobs *jobs, struct live_job *job);
/* A worker complains: reads all of a job's files again, except for those that were read after their last chunk was
 * sent. The job may be gone afterwards. */
void files_read(struct jobs *jobs, struct live_job *job);
bool files_are_read(const struct jobs *jobs, const struct live_job *job); /* some of them, now */
/* What the last reading has found. */
bool files_are_right(const struct jobs *jobs, const struct live_job *job);
void files_tick(struct jobs *jobs); /* jobs that wait for files which exist now continue */

#endif
