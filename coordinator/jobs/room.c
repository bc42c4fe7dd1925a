/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/jobs/room.h"

#include "common/base/disk.h"
#include "coordinator/retention/keep.h"

bool room_make(const struct jobs *jobs)
{
	return blob_store_evict(jobs->blobs) || keep_drop_all(jobs);
}

/* Of the next checkpoint; before the first one, what it has at most. */
static uint64_t checkpoint_size(const struct live_job *job)
{
	return job->checkpoint_bytes ? job->checkpoint_bytes : canvas_bytes(&job->plan);
}

static uint64_t usual_limit(const struct jobs *jobs, const struct live_job *job)
{
	return job->checkpoint_bytes > jobs->config.journal_bytes ? job->checkpoint_bytes : jobs->config.journal_bytes;
}

static uint64_t available(const struct jobs *jobs)
{
	char path[SPOOL_PATH_MAX];
	spool_path(jobs->spool, "jobs", path);
	return disk_available(path);
}

bool room_is_ample(const struct jobs *jobs)
{
	uint64_t need = 0, largest = 0;
	for (const struct live_job *job = jobs->live; job; job = job->next) {
		uint64_t limit = job->kept_bytes + usual_limit(jobs, job), size = checkpoint_size(job);
		need += limit > journal_bytes(job->journal) ? limit - journal_bytes(job->journal) : 0;
		largest = size > largest ? size : largest;
	}
	return need + largest <= available(jobs);
}

uint64_t room_for_journal(const struct jobs *jobs, const struct live_job *job, bool ample)
{
	uint64_t usual = usual_limit(jobs, job), size = checkpoint_size(job);
	return ample || size > usual ? usual : size;
}

bool room_is_left(const struct jobs *jobs, const struct live_job *job, uint64_t bytes)
{
	uint64_t size = checkpoint_size(job), journal = journal_bytes(job->journal);
	return !job->canvas || journal < job->kept_bytes + size || bytes + size <= available(jobs);
}
