/* SPDX-License-Identifier: Apache-2.0 */
/* What a checkpoint contains besides seeds, chain states and films. Stored as a message (stored.h). */
#ifndef COORDINATOR_JOB_CHECKPOINT_HEAD_H
#define COORDINATOR_JOB_CHECKPOINT_HEAD_H

#include "coordinator/job/live_job.h"

struct checkpoint_head {
	uint64_t job, generation;
	uint32_t worker_count;
	double cpu_seconds, bootstrap_cpu_seconds, look_written;
	struct live_job_times times;
	struct bootstrap_result lit;
	struct forecast_history looks;
	struct job_counts counts;
	char fingerprint[256];
};

#endif
