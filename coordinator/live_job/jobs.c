/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/live_job/jobs.h"

#include <assert.h>
#include <string.h>

void jobs_queue_work(struct jobs *jobs, uv_work_t *w, void *data, uv_work_cb work, uv_after_work_cb done)
{
	w->data = data;
	int rc = uv_queue_work(jobs->loop, w, work, done);
	assert(rc == 0);
	(void)rc;
}

double jobs_now(const struct jobs *jobs)
{
	(void)jobs;
	return (double)uv_hrtime() * 1e-9;
}

bool jobs_is_reading(const struct jobs *jobs, uint64_t job)
{
	for (const struct recovering_job *f = jobs->recovering_jobs; f; f = f->next)
		if (f->record.id == job)
			return true;
	return jobs->extended_job && jobs->extended_job->id == job;
}

static uint64_t recovering_film_bytes(const struct jobs *jobs)
{
	uint64_t sum = 0;
	for (const struct recovering_job *f = jobs->recovering_jobs; f; f = f->next)
		if (f->job && f->job->canvas && !canvas_is_mapped(f->job->canvas))
			sum += canvas_bytes(&f->job->plan);
	return sum;
}

const char *jobs_film_folder(const struct jobs *jobs, const struct plan *p)
{
	uint64_t bytes = canvas_bytes(p) + recovering_film_bytes(jobs) +
			 (jobs->extended_job ? canvas_bytes(&jobs->extended_job->plan) : 0);
	for (const struct live_job *job = jobs->live_jobs; job; job = job->next)
		if (job->canvas && !canvas_is_mapped(job->canvas))
			bytes += canvas_bytes(&job->plan);
	return bytes <= jobs->config.max_film_bytes ? NULL : spool_canvas_folder(jobs->spool);
}

struct live_job *jobs_find_live(const struct jobs *jobs, uint64_t id)
{
	for (struct live_job *job = jobs->live_jobs; job; job = job->next)
		if (job->id == id)
			return job;
	return NULL;
}

int jobs_check_quota(const struct jobs *jobs, const char *owner, uint64_t id, uint64_t uploading,
		     const struct plan *plan, const Farm__Submit *m, struct error *e)
{
	struct quota_usage usage = {.asset_bytes = uploading};
	for (const struct live_job *job = jobs->live_jobs; job; job = job->next) {
		if (job->has_ended || job->id == id || strcmp(job->record.owner, owner) != 0)
			continue;
		usage.jobs++;
		usage.asset_bytes += live_job_asset_bytes(live_job_submission(job));
	}
	return quota_check(&jobs->config.quota, &usage, plan, live_job_asset_bytes(m), e);
}
