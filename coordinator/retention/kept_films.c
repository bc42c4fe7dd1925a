/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/retention/kept_films.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "coordinator/store/journal_file.h"

#include <string.h>

bool kept_films_are_wanted(const struct jobs *jobs, const struct live_job *job, const struct job_record *r)
{
	return jobs->config.retained_film_bytes && job->canvas && strcmp(r->reason, job_end_name(END_BLACK)) != 0 &&
	       !job->bootstrap_result.is_black && canvas_complete_rounds(job->canvas) > 0 &&
	       (strcmp(r->state, job_state_name(JOB_DONE)) == 0 || job->has_overflowed);
}

bool kept_films_get_bytes(const struct jobs *jobs, uint64_t job, uint64_t *bytes)
{
	struct error e;
	if (spool_film_bytes(jobs->spool, job, 1, bytes, &e) == 0)
		return true;
	log_event(LOG_SPOOL_FAULT, "job=j%llu text=%s action=\"its films are kept for now\"", (unsigned long long)job,
		  log_quote(e.text).text);
	return false;
}

void kept_films_drop(const struct jobs *jobs, uint64_t job)
{
	char path[SPOOL_PATH_MAX];
	struct error e;
	if (jobs_is_reading(jobs, job))
		return;
	spool_job_path(jobs->spool, job, NULL, path);
	journal_delete_others(path, UINT64_MAX);
	spool_job_path(jobs->spool, job, "checkpoint", path);
	disk_unlink(path);
	if (ledger_delete_submission(jobs->ledger, job, &e))
		log_event(LOG_SPOOL_FAULT, "job=j%llu text=%s", (unsigned long long)job, log_quote(e.text).text);
}

/* Films that are being read for an extension stay, as do those whose deletion fails; neither counts as deleted. */
bool kept_films_drop_all(const struct jobs *jobs)
{
	bool any = false;
	for (size_t i = 0; i < jobs->ended_job_count; i++) {
		uint64_t id = jobs->ended_jobs[i].id, before, after;
		if (!kept_films_get_bytes(jobs, id, &before) || !before)
			continue;
		kept_films_drop(jobs, id);
		any = any || (kept_films_get_bytes(jobs, id, &after) && after < before);
	}
	return any;
}

void kept_films_trim(const struct jobs *jobs)
{
	uint64_t remaining = jobs->config.retained_film_bytes;
	for (size_t i = jobs->ended_job_count; i-- > 0;) { /* starting with the job that ended last */
		uint64_t bytes;
		if (!kept_films_get_bytes(jobs, jobs->ended_jobs[i].id, &bytes))
			continue;
		if (bytes > remaining)
			kept_films_drop(jobs, jobs->ended_jobs[i].id);
		else
			remaining -= bytes;
	}
}

void ended_jobs_add(struct jobs *jobs, const struct job_record *r)
{
	if (jobs->ended_job_count == ENDED_JOBS_MAX) {
		/* Films are counted by this list, which the job leaves. */
		kept_films_drop(jobs, jobs->ended_jobs[0].id);
		memmove(jobs->ended_jobs, jobs->ended_jobs + 1, --jobs->ended_job_count * sizeof *jobs->ended_jobs);
	}
	jobs->ended_jobs[jobs->ended_job_count++] = *r;
}

struct job_record *ended_jobs_find(const struct jobs *jobs, uint64_t job)
{
	for (size_t i = 0; i < jobs->ended_job_count; i++)
		if (jobs->ended_jobs[i].id == job)
			return &jobs->ended_jobs[i];
	return NULL;
}

void ended_jobs_remove(struct jobs *jobs, uint64_t job)
{
	struct job_record *r = ended_jobs_find(jobs, job);
	if (r)
		memmove(r, r + 1, (size_t)(jobs->ended_jobs + --jobs->ended_job_count - r) * sizeof *r);
}

int ended_jobs_open(struct jobs *jobs, struct error *e)
{
	uint64_t ids[ENDED_JOBS_MAX]; /* the job that ended last comes first */
	size_t count;
	int rc = ledger_list_ended(jobs->ledger, LEDGER_LATEST, UINT64_MAX, ids, ENDED_JOBS_MAX, &count, e);
	if (rc)
		return rc;
	jobs->ended_jobs = mem_alloc(ENDED_JOBS_MAX, sizeof *jobs->ended_jobs);
	if (!jobs->ended_jobs)
		return error_set(e, ENOMEM, "no memory for the list of jobs");
	while (count-- > 0) {
		struct error fault;
		rc = ledger_read_record(jobs->ledger, ids[count], &jobs->ended_jobs[jobs->ended_job_count], &fault);
		if (rc)
			log_event(LOG_SPOOL_FAULT, "job=j%llu text=%s", (unsigned long long)ids[count],
				  log_quote(fault.text).text);
		else
			jobs->ended_job_count++;
	}
	log_event(LOG_SPOOL_READ, "path=%s jobs=%zu next=j%llu", log_quote(jobs->config.spool_folder).text,
		  jobs->ended_job_count, (unsigned long long)ledger_next_id(jobs->ledger));
	return 0;
}
