/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Opens the ledger and compares it with the jobs' folders, before any job is read.
 *
 * Files of earlier versions are imported first (import.h). A folder without a row is deleted if nothing was merged in
 * it, because its job was never accepted; if the whole ledger is new, a folder with a journal counts as that of an
 * accepted job. A folder without a row but with results is that of a lost job, as is a row that is damaged in both
 * files of the ledger. Without --accept-loss the start then ends with -EBADMSG and a list of what is missing; with it
 * the folder is moved to spool/lost with an explanation. An error of the machine ends the start without further
 * changes.
 */
#include "coordinator/jobs/reconcile.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/jobs/import.h"
#include "coordinator/store/journal_file.h"

#include <stdio.h>
#include <string.h>

enum { LOST_NAMES_MAX = 8 /* lost jobs that the error names */ };

struct reconciliation {
	struct jobs *jobs;
	uint64_t lost_count;
	char text[600]; /* their names */
	struct text names;
};

static void log_fault(uint64_t id, const char *what)
{
	log_event(LOG_SPOOL_FAULT, "job=j%llu text=%s", (unsigned long long)id, log_quote(what).text);
}

/* Moves the folder to spool/lost, so that an operator can look into it, and deletes the row. */
static int move_to_lost(struct reconciliation *l, uint64_t id, const char *why, struct error *e)
{
	const struct spool *spool = l->jobs->spool;
	char from[SPOOL_PATH_MAX], to[SPOOL_PATH_MAX], lost[SPOOL_PATH_MAX], jobs[SPOOL_PATH_MAX], name[64];
	struct stat st;
	spool_job_path(spool, id, NULL, from);
	spool_path(spool, "jobs", jobs);
	spool_path(spool, "lost", lost);
	int rc = ledger_delete(l->jobs->ledger, id, e);
	if (rc || disk_stat(from, &st))
		return rc;
	rc = disk_make_folder(lost, e);
	if (!rc)
		rc = spool_write_job_file(spool, id, "why", why, strlen(why), e);
	for (unsigned n = 0; !rc; n++) {
		snprintf(name, sizeof name, n ? "lost/j%llu.%u" : "lost/j%llu", (unsigned long long)id, n);
		spool_path(spool, name, to);
		if (disk_stat(to, &st) == 0)
			continue;
		rc = disk_rename(from, to) ? error_file(e, errno, to) : disk_sync_folder(lost, e);
		return rc ? rc : disk_sync_folder(jobs, e);
	}
	return rc;
}

static int handle_lost_job(struct reconciliation *l, uint64_t id, const char *why, struct error *e)
{
	char text[400];
	text_print(text, sizeof text, "j%llu (%s)", (unsigned long long)id, why);
	if (l->lost_count++ < LOST_NAMES_MAX)
		text_appendf(&l->names, "%s%s", l->lost_count > 1 ? ", " : "", text);
	if (!l->jobs->config.accept_loss) {
		log_fault(id, why);
		return 0;
	}
	int rc = move_to_lost(l, id, why, e);
	text_print(text, sizeof text, "%s: given up; the rest of it is in spool/lost", why);
	log_fault(id, text);
	return rc;
}

/* Whether the job must have been accepted, because something of it was merged or made: returns 1, 0 or -errno.
 * journal_suffices: a journal is enough, even an empty one. This is for a ledger that knows no job: otherwise an id is
 * noted in the ledger before the job gets a folder. A folder that cannot be read says nothing, hence -errno. */
static int check_results_exist(const struct spool *spool, uint64_t id, bool journal_suffices, struct error *e)
{
	char folder[SPOOL_PATH_MAX], path[SPOOL_PATH_MAX];
	struct stat st;
	int any = 0;
	spool_job_path(spool, id, NULL, folder);
	struct disk_list l;
	disk_list_begin(&l, folder);
	for (const char *name; !any && (name = disk_list_next(&l));) {
		bool journal = strncmp(name, "journal.", 8) == 0;
		if (!journal && strcmp(name, "checkpoint") != 0 && strcmp(name, "result.exr") != 0)
			continue;
		spool_job_path(spool, id, name, path);
		if (disk_stat(path, &st))
			any = error_file(e, errno, path);
		else
			any = !journal || journal_suffices || st.st_size > (off_t)JOURNAL_HEAD_SIZE;
	}
	struct error fault;
	int rc = disk_list_end(&l, 0, &fault);
	if (any || !rc || rc == -ENOTDIR)
		return any;
	*e = fault;
	return rc;
}

static int check_folder(struct reconciliation *l, uint64_t id, struct error *e)
{
	struct ledger_job j;
	int rc = ledger_read_row(l->jobs->ledger, id, &j, e);
	if (rc < 0)
		return rc;
	if (rc)
		return j.is_damaged ? handle_lost_job(l, id, "its rows in jobs.db and jobs-copy.db are damaged", e) : 0;
	rc = check_results_exist(l->jobs->spool, id, ledger_is_new(l->jobs->ledger), e);
	if (rc < 0)
		return rc;
	if (rc)
		return handle_lost_job(l, id, "jobs.db and jobs-copy.db have no row for it, and its folder has results",
				       e);
	struct error drop_error;
	if (spool_delete_job(l->jobs->spool, id, &drop_error)) /* a folder that cannot be deleted does no harm */
		log_fault(id, drop_error.text);
	return 0;
}

static int check_folders(struct reconciliation *l, struct error *e)
{
	uint64_t *ids;
	size_t count;
	int rc = spool_list_jobs(l->jobs->spool, &ids, &count, e);
	for (size_t i = 0; i < count && !rc; i++)
		rc = check_folder(l, ids[i], e);
	if (!rc && count)
		rc = ledger_skip_ids(l->jobs->ledger, ids[count - 1], e);
	mem_free(ids);
	return rc;
}

/* Looks at rows without a folder. Live jobs among them fail later with a sentence (recovery.c). */
static int check_rows(struct reconciliation *l, struct error *e)
{
	struct ledger_job j;
	char path[SPOOL_PATH_MAX];
	struct stat st;
	uint64_t *ids;
	size_t count;
	int rc = ledger_list_ids(l->jobs->ledger, LEDGER_ALL, &ids, &count, e);
	for (size_t i = 0; i < count && !rc; i++) {
		spool_job_path(l->jobs->spool, ids[i], NULL, path);
		if (disk_stat(path, &st) == 0) /* check_folder has read its row */
			continue;
		rc = ledger_read_row(l->jobs->ledger, ids[i], &j, e);
		if (rc > 0)
			rc = j.is_damaged
				     ? handle_lost_job(
					       l, ids[i],
					       "its rows in jobs.db and jobs-copy.db are damaged, and its folder is missing",
					       e)
				     : 0;
	}
	mem_free(ids);
	return rc;
}

int reconcile_spool(struct jobs *jobs, struct error *e)
{
	struct reconciliation l = {.jobs = jobs};
	l.names = (struct text){l.text, sizeof l.text};
	int rc = ledger_open(&jobs->ledger, jobs->config.spool_folder, e);
	if (!rc)
		rc = import_files(jobs, e);
	if (!rc)
		rc = check_folders(&l, e);
	if (!rc)
		rc = check_rows(&l, e);
	if (rc || !l.lost_count || jobs->config.accept_loss)
		return rc;
	return error_set(
		e, EBADMSG,
		"%s has lost %llu job%s: %s%s. Nothing has been deleted. Put back what is missing, or start with "
		"--accept-loss: what is left of them is then moved to lost/ in the spool, and the other jobs continue",
		jobs->config.spool_folder, (unsigned long long)l.lost_count, l.lost_count == 1 ? "" : "s", l.text,
		l.lost_count > LOST_NAMES_MAX ? ", ..." : "");
}
