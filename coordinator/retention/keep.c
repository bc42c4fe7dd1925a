/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/retention/keep.h"
#include "coordinator/store/journal_file.h"

#include "common/base/disk.h"

#include <string.h>

bool keep_films(const struct jobs *jobs, const struct live_job *job, const struct job_record *r)
{
	return jobs->config.keep_bytes && job->canvas && !job->lit.black && canvas_rounds(job->canvas) > 0 &&
	       (strcmp(r->state, job_state_name(JOB_DONE)) == 0 || job->overflowed);
}

void keep_drop(const struct jobs *jobs, uint64_t job)
{
	char path[SPOOL_PATH_MAX];
	struct error e;
	if (jobs_is_read(jobs, job))
		return;
	spool_job_path(jobs->spool, job, NULL, path);
	journal_clear(path, UINT64_MAX);
	spool_job_path(jobs->spool, job, "checkpoint", path);
	disk_unlink(path);
	if (ledger_drop_submission(jobs->ledger, job, &e))
		log_event(LOG_SPOOL_FAULT, "job=j%llu text=%s", (unsigned long long)job, log_quote(e.text).text);
}

bool keep_drop_all(const struct jobs *jobs)
{
	bool any = false;
	for (size_t i = 0; i < jobs->ended_count; i++)
		if (spool_film_bytes(jobs->spool, jobs->ended[i].id, 1)) {
			keep_drop(jobs, jobs->ended[i].id);
			any = true;
		}
	return any;
}

void keep_trim(const struct jobs *jobs)
{
	uint64_t left = jobs->config.keep_bytes;
	for (size_t i = jobs->ended_count; i-- > 0;) { /* starting with the most recent */
		uint64_t bytes = spool_film_bytes(jobs->spool, jobs->ended[i].id, 1);
		if (bytes > left)
			keep_drop(jobs, jobs->ended[i].id);
		else
			left -= bytes;
	}
}
