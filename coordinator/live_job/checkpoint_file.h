/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The file of a job's checkpoint (coordinator/jobs/checkpoint.h), with a checksum (common/base/checked_file.h),
 * little endian:
 *
 * offset  bytes       contents
 * 0       8           magic number and version, hsltC005
 * 8       4           N
 * 12      N           CheckpointHead of proto/stored.proto
 * 12 + N  8 a chain   jobs with chains: the seeds, group by group
 *         4 a lease   for each group and part: 0 if no epoch has been merged yet, otherwise 1, followed by the
 *         4 + size    size of the state of each of its chains and the state itself
 *                     films (common/film/canvas_save.h)
 *
 * Any thread, while nobody changes the job.
 */
#ifndef COORDINATOR_LIVE_JOB_CHECKPOINT_FILE_H
#define COORDINATOR_LIVE_JOB_CHECKPOINT_FILE_H

#include "common/base/checked_file.h"
#include "coordinator/live_job/stored.h"

/* checkpoint_head_fill fills in the head, with the generation of the journal that will follow the checkpoint;
 * checkpoint_write writes the head and the job's current state. */
void checkpoint_head_fill(struct checkpoint_head *h, const struct live_job *job, const struct job_status *status);
int checkpoint_write(const struct live_job *job, const struct checkpoint_head *h, struct checked_file *out,
		     struct error *e);

/* Loads a checkpoint into a new live job without merged batches. *generation: of the journal that follows it.
 * progress: as in checked_file.h. Returns -ENOENT if there is no file, -EBADMSG if it is damaged, -EPROTO if it is of
 * another version; after the last two the live job is unusable. */
int checkpoint_load(const struct spool *spool, struct live_job *job, uint64_t *generation,
		    checked_file_progress *progress, void *user, struct error *e);

#endif
