/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/retention/keep.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "coordinator/store/journal_file.h"

#include <string.h>

bool keep_films(const struct jobs *jobs, const struct live_job *job, const struct job_record *r)
{
	return jobs->config.keep_bytes && job->canvas && strcmp(r->reason, job_end_name(END_BLACK)) != 0 &&
	       !job->lit.black && canvas_rounds(job->canvas) > 0 &&
	       (strcmp(r->state, job_state_name(JOB_DONE)) == 0 || job->overflowed);
}

bool keep_bytes(const struct jobs *jobs, uint64_t job, uint64_t *bytes)
{
	struct error e;
	if (spool_film_bytes(jobs->spool, job, 1, bytes, &e) == 0)
		return true;
	log_event(LOG_SPOOL_FAULT, "job=j%llu text=%s action=\"its films are kept for now\"", (unsigned long long)job,
		  log_quote(e.text).text);
	return false;
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

/* Films that are being read for an extension stay, as do those whose deletion fails; neither counts as deleted. */
bool keep_drop_all(const struct jobs *jobs)
{
	bool any = false;
	for (size_t i = 0; i < jobs->ended_count; i++) {
		uint64_t id = jobs->ended[i].id, before, after;
		if (!keep_bytes(jobs, id, &before) || !before)
			continue;
		keep_drop(jobs, id);
		any = any || (keep_bytes(jobs, id, &after) && after < before);
	}
	return any;
}

void keep_trim(const struct jobs *jobs)
{
	uint64_t left = jobs->config.keep_bytes;
	for (size_t i = jobs->ended_count; i-- > 0;) { /* starting with the job that ended last */
		uint64_t bytes;
		if (!keep_bytes(jobs, jobs->ended[i].id, &bytes))
			continue;
		if (bytes > left)
			keep_drop(jobs, jobs->ended[i].id);
		else
			left -= bytes;
	}
}

void ended_jobs_add(struct jobs *jobs, const struct job_record *r)
{
	if (jobs->ended_count == ENDED_MAX) {
		keep_drop(jobs, jobs->ended[0].id); /* films are counted by this list, which the job leaves */
		memmove(jobs->ended, jobs->ended + 1, --jobs->ended_count * sizeof *jobs->ended);
	}
	jobs->ended[jobs->ended_count++] = *r;
}

struct job_record *ended_jobs_find(const struct jobs *jobs, uint64_t job)
{
	for (size_t i = 0; i < jobs->ended_count; i++)
		if (jobs->ended[i].id == job)
			return &jobs->ended[i];
	return NULL;
}

void ended_jobs_remove(struct jobs *jobs, uint64_t job)
{
	struct job_record *r = ended_jobs_find(jobs, job);
	if (r)
		memmove(r, r + 1, (size_t)(jobs->ended + --jobs->ended_count - r) * sizeof *r);
}

int ended_jobs_open(struct jobs *jobs, struct error *e)
{
	uint64_t ids[ENDED_MAX]; /* the job that ended last comes first */
	size_t count;
	int rc = ledger_ended(jobs->ledger, LEDGER_LAST, UINT64_MAX, ids, ENDED_MAX, &count, e);
	if (rc)
		return rc;
	jobs->ended = mem_alloc(ENDED_MAX, sizeof *jobs->ended);
	if (!jobs->ended)
		return error_set(e, ENOMEM, "no memory for the list of jobs");
	while (count-- > 0) {
		struct error fault;
		rc = ledger_read_record(jobs->ledger, ids[count], &jobs->ended[jobs->ended_count], &fault);
		if (rc)
			log_event(LOG_SPOOL_FAULT, "job=j%llu text=%s", (unsigned long long)ids[count],
				  log_quote(fault.text).text);
		else
			jobs->ended_count++;
	}
	log_event(LOG_SPOOL_READ, "path=%s jobs=%zu next=j%llu", log_quote(jobs->config.spool).text, jobs->ended_count,
		  (unsigned long long)ledger_next_id(jobs->ledger));
	return 0;
}
