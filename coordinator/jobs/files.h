/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Scene files in spool/blobs, which may get damaged: they are checked before they are sent to anyone. A job with a
 * missing or damaged file is held, and its status names the file; submitting the scene again repairs it, and the job
 * continues. No worker is blamed. The loop's thread; files are read by the pool, one at a time, and whoever needs one
 * waits for it.
 */
#ifndef COORDINATOR_JOBS_FILES_H
#define COORDINATOR_JOBS_FILES_H

#include "coordinator/live_job/jobs.h"

enum { FILES_CHECKED_SECONDS = 60 /* s: a file checked within this time is not read again before it is sent */ };

/* Checks a file that a worker requests or a client submits. Returns 0 if it is right; -EINPROGRESS if it is being
 * read, in which case announce_file_checked of peer_calls.h follows. After other errors it cannot be sent, and the jobs
 * that lack it are held. */
int files_check(struct jobs *jobs, const struct blob_hash *h, struct error *e);
/* Holds the job if the store lacks one of its files, or releases it if it lacks none any more. Returns true if a step
 * was made, after which any job may be gone. */
bool files_update_hold(struct jobs *jobs, struct live_job *job);
/* Call when a worker complains: has all files of the job read again, except those that were read after their last
 * chunk was sent. The job may be gone afterwards. */
void files_reread(struct jobs *jobs, struct live_job *job);
/* Whether some of its files are being read. */
bool files_are_being_read(const struct jobs *jobs, const struct live_job *job);
/* Whether all files of the job were right when last read. */
bool files_are_intact(const struct jobs *jobs, const struct live_job *job);
void files_tick(struct jobs *jobs); /* releases jobs whose missing files exist now */

#endif
