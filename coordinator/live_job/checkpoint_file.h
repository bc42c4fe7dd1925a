/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The file of a job's checkpoint (coordinator/jobs/checkpoint.h), checked (common/base/checked_file.h), little endian:
 *
 * offset  bytes       contents
 * 0       8           magic number and version, hsltC005
 * 8       4           N
 * 12      N           CheckpointHead of proto/stored.proto
 * 12 + N  8 a chain   chains: the seeds, group by group
 *         4 a lease   for each group and part of it: 0 if no epoch has been merged yet, otherwise 1, followed by the
 *         4 + size    size of each of its chains' states and the state itself
 *                     films (common/film/canvas_save.h)
 *
 * Any thread, while nobody changes the job.
 */
#ifndef COORDINATOR_LIVE_JOB_CHECKPOINT_FILE_H
#define COORDINATOR_LIVE_JOB_CHECKPOINT_FILE_H

#include "common/base/checked_file.h"
#include "coordinator/live_job/stored.h"

/* Writes the job's current state, to be followed by the next journal. */
void checkpoint_head_of(struct checkpoint_head *h, const struct live_job *job, const struct job_status *status);
int checkpoint_write(const struct live_job *job, const struct checkpoint_head *h, struct checked_file *out,
		     struct error *e);

/* Loads into a new live job without merged batches. -ENOENT: there is no file; -EBADMSG: it is damaged; -EPROTO:
 * another version; the live job is then unusable. generation: that of the journal that follows. progress: as in
 * checked_file.h. */
int checkpoint_load(const struct spool *spool, struct live_job *job, uint64_t *generation,
		    checked_file_progress *progress, void *user, struct error *e);

#endif
