/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Finds jobs for display, wherever they are: live, being read after a restart, among the last ENDED_JOBS_MAX that
 * ended, or only in the ledger.
 */
#include "coordinator/jobs/listing.h"

#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/jobs/recovery.h"
#include "coordinator/retention/kept_films.h"

#include <stdlib.h>
#include <string.h>

bool jobs_get_end_view(const struct jobs *jobs, const struct live_job *job, struct job_view *v)
{
	struct job_status status;
	struct canvas_counts counted;
	view_from_record(v, &job->record);
	if (job->canvas) { /* at the end only what the image contains, before that everything received */
		canvas_sum_counts(job->canvas, !job->has_ended, &counted);
		record_set_counters(&v->record, &job->plan, &counted, job->is_black,
				    job->bootstrap_result.overlong_share);
		record_add_note(&v->record, job->quarantine_notes);
	}
	if (job->has_ended)
		record_add_doubt(&v->record);
	if (!farm_job_status(jobs->farm, job->id, jobs_now(jobs), &status))
		return false;
	if (status.state == JOB_CANCELLED && job->earlier_record) { /* its image is still that of its earlier end */
		view_from_record(v, job->earlier_record);
		v->record.extended = job->record.extended;
		v->record.priority = job->record.priority;
		v->record.cut = true;
		return true;
	}
	view_add_status(v, &status);
	return true;
}

static void view_live(const struct jobs *jobs, const struct live_job *job, struct job_view *v)
{
	if (!jobs_get_end_view(jobs, job, v))
		return;
	/* It is not shown as ended before its image and record exist. */
	if (job->has_ended && (job->is_busy || job->is_publish_pending || job->is_record_pending)) {
		text_copy(v->record.state, sizeof v->record.state, job_state_name(JOB_RUNNING));
		if (*job->record.why)
			text_print(v->waiting, sizeof v->waiting, "its %s cannot be written: %s",
				   job->is_record_pending ? "record" : "image", job->record.why);
		else
			text_copy(v->waiting, sizeof v->waiting, "its image is being written");
		memcpy(v->owners_waiting, v->waiting, sizeof v->waiting);
		v->record.reason[0] = 0;
		v->record.exit_code = 0;
	}
}

bool jobs_get_view(struct jobs *jobs, uint64_t id, struct job_view *v)
{
	struct job_record r;
	struct live_job *job = jobs_find_live(jobs, id);
	if (job) {
		view_live(jobs, job, v);
		return true;
	}
	if (recovery_get_view(jobs, id, v))
		return true;
	const struct job_record *ended = ended_jobs_find(jobs, id);
	if (!ended && ledger_read_record(jobs->ledger, id, &r, NULL))
		return false;
	view_from_record(v, ended ? ended : &r);
	return true;
}

static int compare_ids(const void *a, const void *b)
{
	const struct job_view *x = a, *y = b;
	return (x->record.id > y->record.id) - (x->record.id < y->record.id);
}

size_t jobs_list_views(struct jobs *jobs, size_t max_ended, struct job_view **views)
{
	size_t ended = jobs->ended_job_count < max_ended ? jobs->ended_job_count : max_ended;
	size_t count = ended + recovery_list_views(jobs, NULL), n = 0;
	for (struct live_job *job = jobs->live_jobs; job; job = job->next)
		count++;
	*views = mem_alloc(count, sizeof **views);
	if (!*views)
		return 0;
	for (size_t i = jobs->ended_job_count - ended; i < jobs->ended_job_count; i++)
		view_from_record(&(*views)[n++], &jobs->ended_jobs[i]);
	for (struct live_job *job = jobs->live_jobs; job; job = job->next)
		view_live(jobs, job, &(*views)[n++]);
	n += recovery_list_views(jobs, *views + n);
	qsort(*views, count, sizeof **views, compare_ids);
	return count;
}
