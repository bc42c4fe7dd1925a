/* SPDX-License-Identifier: Apache-2.0 */
/* The file of a job's checkpoint (coordinator/jobs/checkpoint.h). By any thread, while nobody changes the job. */
#ifndef COORDINATOR_JOB_CHECKPOINT_FILE_H
#define COORDINATOR_JOB_CHECKPOINT_FILE_H

#include "common/base/checked_file.h"
#include "coordinator/core/farm.h"
#include "coordinator/job/live_job.h"

/* As it lies in memory. Whoever changes it, or what follows it, counts the version up. */
struct checkpoint_head {
	char magic[8];
	uint32_t bytes, worker_count;
	uint64_t job, generation;
	double cpu_seconds, bootstrap_cpu_seconds, look_written;
	struct live_job_times times;
	struct bootstrap_result lit;
	struct forecast_history looks;
	struct job_counts counts;
	char fingerprint[256];
};

/* Of the job as it is, and of a journal that follows the one it has. */
void checkpoint_head_of(struct checkpoint_head *h, const struct live_job *o, const struct job_status *status);
int checkpoint_write(const struct live_job *o, const struct checkpoint_head *h, struct checked_file *out,
		     struct error *e);

/* Into a new order without merged batches, by any thread. -ENOENT: there is none; -EBADMSG: it is damaged; -EPROTO: of
 * another version; the live job is of no use then. generation: of the journal that follows. progress: as in
 * checked_file.h.
 */
int checkpoint_load(const struct spool *spool, struct live_job *o, uint64_t *generation,
		    checked_file_progress *progress, void *user, struct error *e);

#endif
