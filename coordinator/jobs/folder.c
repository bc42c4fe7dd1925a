/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/jobs/folder.h"

#include "common/base/disk.h"
#include "coordinator/jobs/durable.h"
#include "coordinator/jobs/late_feed.h"

static const double check_interval_seconds = 1;

static int recreate_folder(struct jobs *jobs, struct live_job *job, struct error *e)
{
	char path[SPOOL_PATH_MAX];
	spool_path(jobs->spool, "jobs", path);
	int rc = disk_make_folder(path, e);
	if (!rc)
		rc = spool_create_job_folder(jobs->spool, job->id, e);
	if (rc)
		return rc;
	spool_job_path(jobs->spool, job->id, "log", path);
	int fd = disk_open(path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
	if (fd < 0)
		return error_file(e, errno, path);
	disk_close(job->log_fd);
	job->log_fd = fd;
	return 0;
}

/* Restores the folder of a live job. Merged data is in memory or in the old journal, whose file is still open: a
 * checkpoint is made of the former, and the latter is copied into a new file. */
static void restore_folder(struct jobs *jobs, struct live_job *job)
{
	char folder[SPOOL_PATH_MAX];
	struct error e;
	spool_job_path(jobs->spool, job->id, NULL, folder);
	int rc = recreate_folder(jobs, job, &e);
	live_job_log(job, LOG_SPOOL_FAULT, "text=\"%s was removed or moved away while the job runs: %s\"", folder,
		     rc ? e.text : "restored, and the job continues");
	if (rc) {
		if (!job->has_ended)
			durable_hold_job(jobs, job, "its folder is missing and cannot be restored", e.text);
		return;
	}
	if (job->has_ended)
		return;
	journal_mark_bad(job->journal);
	if (job->checkpoint_bytes) {
		/* Results that wait exist only in the old journal, and no checkpoint contains them. */
		if (!late_results_drop_all(jobs, job->id))
			return;
		job->is_checkpoint_uncertain = true;
		if (job->min_generation <= journal_generation(job->journal))
			job->min_generation = journal_generation(job->journal) + 1;
		job->min_checkpoint_time = 0;
	}
	durable_hold_job(jobs, job, "its results cannot be stored", "its folder was removed, and is being restored");
}

/* Whether the job's folder has disappeared. Normally the journal's file is looked for. If the journal is bad already,
 * or the job has ended and needs none, the folder itself is looked for; it may disappear again while it is being
 * restored. */
static bool is_gone(const struct jobs *jobs, const struct live_job *job)
{
	char folder[SPOOL_PATH_MAX];
	struct stat st;
	if (!journal_is_bad(job->journal) && !job->has_ended)
		return journal_file_is_missing(job->journal);
	spool_job_path(jobs->spool, job->id, NULL, folder);
	return disk_stat(folder, &st) && (errno == ENOENT || errno == ENOTDIR);
}

void folder_tick(struct jobs *jobs)
{
	if (jobs_now(jobs) < jobs->next_folder_check_at)
		return;
	jobs->next_folder_check_at = jobs_now(jobs) + check_interval_seconds;
	for (struct live_job *job = jobs->live_jobs; job; job = job->next)
		if (!job->is_busy && job->journal && is_gone(jobs, job)) {
			restore_folder(jobs, job);
			return; /* the list may have changed; continue next time */
		}
}
