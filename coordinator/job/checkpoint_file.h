/* SPDX-License-Identifier: Apache-2.0 */
/* The file of a job's checkpoint (coordinator/jobs/checkpoint.h). By any thread, while nobody changes the job. */
#ifndef COORDINATOR_JOB_CHECKPOINT_FILE_H
#define COORDINATOR_JOB_CHECKPOINT_FILE_H

#include "common/base/checked_file.h"
#include "coordinator/core/farm.h"
#include "coordinator/job/checkpoint_head.h"

/* Of the job as it is, and of a journal that follows the one it has. */
void checkpoint_head_of(struct checkpoint_head *h, const struct live_job *job, const struct job_status *status);
int checkpoint_write(const struct live_job *job, const struct checkpoint_head *h, struct checked_file *out,
		     struct error *e);

/* Into a new order without merged batches, by any thread. -ENOENT: there is none; -EBADMSG: it is damaged; -EPROTO: of
 * another version; the live job is of no use then. generation: of the journal that follows. progress: as in
 * checked_file.h.
 */
int checkpoint_load(const struct spool *spool, struct live_job *job, uint64_t *generation,
		    checked_file_progress *progress, void *user, struct error *e);

#endif
