/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/jobs/ended_jobs.h"

#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/jobs/restore.h"
#include "coordinator/retention/ages.h"
#include "coordinator/retention/keep.h"

#include <string.h>
#include <time.h>

void ended_jobs_add(struct jobs *jobs, const struct job_record *r)
{
	if (jobs->ended_count == ENDED_MAX) {
		keep_drop(jobs, jobs->ended[0].id); /* nobody would count its films any more */
		memmove(jobs->ended, jobs->ended + 1, --jobs->ended_count * sizeof *jobs->ended);
	}
	jobs->ended[jobs->ended_count++] = *r;
}

void ended_jobs_remove(struct jobs *jobs, uint64_t job)
{
	for (size_t i = 0; i < jobs->ended_count; i++)
		if (jobs->ended[i].id == job) {
			memmove(&jobs->ended[i], &jobs->ended[i + 1], (--jobs->ended_count - i) * sizeof *jobs->ended);
			return;
		}
}

/* Jobs of an earlier run that have ended, and those that were never accepted, whose client got no answer. */
int ended_jobs_open(struct jobs *jobs, struct error *e)
{
	uint64_t *ids;
	size_t count;
	int rc = spool_jobs(jobs->spool, &ids, &count, e);
	if (rc)
		return rc;
	jobs->ended = mem_alloc(ENDED_MAX, sizeof *jobs->ended);
	if (!jobs->ended) {
		mem_free(ids);
		return error_set(e, ENOMEM, "no memory for the list of jobs");
	}
	for (size_t i = count > ENDED_MAX ? count - ENDED_MAX : 0; i < count; i++) {
		struct job_record *r = &jobs->ended[jobs->ended_count];
		struct error fault;
		if (restore_lives(jobs, ids[i]))
			continue;
		rc = spool_read_record(jobs->spool, ids[i], r, &fault);
		if (rc == -ENOENT) /* the number of a job that has no record yet */
			continue;
		if (rc) {
			log_event(LOG_SPOOL_FAULT, "job=j%llu text=%s", (unsigned long long)ids[i],
				  log_quote(fault.text).text);
			continue;
		}
		if (!record_is_ended(r)) {
			text_copy(r->state, sizeof r->state, "failed");
			text_copy(r->reason, sizeof r->reason, job_end_name(END_FAILED));
			text_copy(r->why, sizeof r->why, "the coordinator stopped before the job was accepted");
			r->exit_code = 3;
			r->ended = (double)time(NULL);
			r->ended_seen = ages_now(jobs);
			if (spool_write_record(jobs->spool, r, &fault))
				log_event(LOG_SPOOL_FAULT, "text=%s", log_quote(fault.text).text);
		}
		jobs->ended_count++;
	}
	mem_free(ids);
	log_event(LOG_SPOOL_READ, "path=%s jobs=%zu next=j%llu", log_quote(jobs->config.spool).text, jobs->ended_count,
		  (unsigned long long)spool_next_job(jobs->spool));
	return 0;
}
