/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Compares the database of jobs with the jobs' folders, before any job is read.
 *
 * For each folder and each row, look_at considers the row, its copy (row_file.h) and the record. What is missing is
 * made from the others: a row from its copy, a copy from the row, the damaged record of an ended job from the row. An
 * unreadable database is put aside and rebuilt from the copies.
 *
 * A job with results but neither row nor copy is lost: without --accept-loss the start ends with -EBADMSG and a list of
 * what is missing; with it the folder is moved to spool/lost with an explanation. An error of the machine ends the
 * start without further changes.
 */
#include "coordinator/jobs/reconcile.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/store/journal_file.h"
#include "coordinator/store/row_file.h"

#include <stdio.h>
#include <string.h>
#include <time.h>

enum { NAMED_MOST = 8 /* of the lost jobs, in the error */ };

struct looking {
	struct jobs *jobs;
	struct job_record *record; /* about the current job */
	uint64_t lost, last;	   /* number of jobs; the highest id of a row */
	char text[600];		   /* which */
	struct text names;
};

static void log_fault(uint64_t id, const char *what)
{
	log_event(LOG_SPOOL_FAULT, "job=j%llu text=%s", (unsigned long long)id, log_quote(what).text);
}

/* ---- lost jobs ---- */

/* Its folder is kept, for somebody who knows more. */
static int put_aside(struct looking *l, uint64_t id, const char *why, struct error *e)
{
	const struct spool *spool = l->jobs->spool;
	char from[SPOOL_PATH_MAX], to[SPOOL_PATH_MAX], lost[SPOOL_PATH_MAX], jobs[SPOOL_PATH_MAX], name[64];
	struct stat st;
	spool_job_path(spool, id, NULL, from);
	spool_path(spool, "jobs", jobs);
	spool_path(spool, "lost", lost);
	int rc = ledger_forget(l->jobs->ledger, id, e);
	if (rc || disk_stat(from, &st))
		return rc;
	rc = disk_make_folder(lost, e);
	if (!rc)
		rc = spool_write(spool, id, "why", why, strlen(why), e);
	for (unsigned n = 0; !rc; n++) {
		snprintf(name, sizeof name, n ? "lost/j%llu.%u" : "lost/j%llu", (unsigned long long)id, n);
		spool_path(spool, name, to);
		if (disk_stat(to, &st) == 0)
			continue;
		rc = disk_rename(from, to) ? error_set(e, errno, "%s: %s", to, strerror(errno))
					   : disk_sync_folder(lost, e);
		return rc ? rc : disk_sync_folder(jobs, e);
	}
	return rc;
}

static int is_lost(struct looking *l, uint64_t id, const char *why, struct error *e)
{
	char text[400];
	text_print(text, sizeof text, "j%llu (%s)", (unsigned long long)id, why);
	if (l->lost++ < NAMED_MOST)
		text_put(&l->names, "%s%s", l->lost > 1 ? ", " : "", text);
	if (!l->jobs->config.accept_loss) {
		log_fault(id, why);
		return 0;
	}
	int rc = put_aside(l, id, why, e);
	text_print(text, sizeof text, "%s: given up; the rest of it is in spool/lost", why);
	log_fault(id, text);
	return rc;
}

/* ---- damaged records of ended jobs ---- */

/* What its row still knows: the job is listed, and its image can be fetched. The image's header is not read. */
static int make_record(struct looking *l, const struct ledger_job *j, struct error *e)
{
	const struct spool *spool = l->jobs->spool;
	struct job_record *r = l->record;
	char path[SPOOL_PATH_MAX], kept[SPOOL_PATH_MAX];
	struct stat st;
	memset(r, 0, sizeof *r);
	record_begin_convergence(r);
	r->id = j->id;
	text_copy(r->name, sizeof r->name, j->name);
	text_copy(r->owner, sizeof r->owner, j->owner);
	text_copy(r->state, sizeof r->state, j->state);
	r->priority = j->priority;
	r->extended = j->extended;
	r->submitted = j->submitted;
	r->ended = j->ended;
	r->ended_seen = r->rel_error = -1;
	spool_job_path(spool, j->id, "result.exr", path);
	r->has_result = disk_stat(path, &st) == 0;
	r->exit_code = r->has_result ? 0 : 3;
	r->progress = r->has_result;
	record_add_note(r, "its record (job.json) was damaged: what it counted and estimated is lost");
	spool_job_path(spool, j->id, "job.json", path);
	spool_job_path(spool, j->id, "job.json.damaged", kept);
	if (disk_rename(path, kept) && errno != ENOENT)
		return error_set(e, errno, "%s: %s", kept, strerror(errno));
	log_fault(j->id, "its record (job.json) was damaged: restored from jobs.db, and kept as job.json.damaged");
	return spool_write_record(spool, r, e);
}

/* ---- one job ---- */

/* Something of it was merged or started, so the job had been accepted. */
static bool has_results(const struct spool *spool, uint64_t id)
{
	char path[SPOOL_PATH_MAX];
	struct stat st;
	spool_job_path(spool, id, NULL, path);
	DIR *d = disk_opendir(path);
	bool any = false;
	for (struct dirent *f; d && !any && (f = readdir(d));) {
		bool journal = strncmp(f->d_name, "journal.", 8) == 0;
		if (!journal && strcmp(f->d_name, "checkpoint") != 0)
			continue;
		spool_job_path(spool, id, f->d_name, path);
		any = disk_stat(path, &st) == 0 && (!journal || st.st_size > (off_t)JOURNAL_HEAD);
	}
	if (d)
		closedir(d);
	return any;
}

/* From its copy; whether it is live or has ended is in its record. */
static int make_row(struct looking *l, struct row_file *f, bool ended, const char *why, struct error *e)
{
	if (ended) {
		f->job.state = l->record->state;
		f->job.ended = l->record->ended > 0 ? l->record->ended : 1;
		f->job.submission = f->job.plan = NULL;
		f->job.submission_size = f->job.plan_size = 0;
	}
	log_fault(f->job.id, why);
	return ledger_put(l->jobs->ledger, &f->job, e);
}

/* The row exists and is undamaged. */
static int with_row(struct looking *l, const struct ledger_job *j, struct row_file *f, int file, bool ended,
		    struct error *e)
{
	if (!file && f->job.revision > j->revision)
		return make_row(l, f, ended && l->record->extended == f->job.extended,
				"its row in jobs.db was older than the copy in its folder: restored from it", e);
	if (j->ended > 0 || (!file && f->job.revision == j->revision))
		return 0;
	if (file == -EBADMSG)
		log_fault(j->id, "the copy of its row in its folder (order) is damaged: restored from jobs.db");
	if (row_file_write(l->jobs->spool, j, e))
		log_fault(j->id, e->text); /* a full disk must not stop the job */
	return 0;
}

static int without_row(struct looking *l, uint64_t id, bool damaged, struct row_file *f, int file, bool ended,
		       struct error *e)
{
	if (!file)
		return make_row(l, f, ended && l->record->extended == f->job.extended,
				damaged ? "its row in jobs.db was damaged: restored from its folder"
					: "jobs.db had lost its row: restored from its folder",
				e);
	if (ended)
		return damaged ? ledger_forget(l->jobs->ledger, id, e) : 0; /* its record contains everything */
	if (damaged)
		return is_lost(
			l, id,
			"its row in jobs.db is damaged, and the copy in its folder (order) is damaged or missing", e);
	if (file == -EBADMSG)
		return is_lost(l, id, "jobs.db has no row for it, and the copy in its folder (order) is damaged", e);
	return has_results(l->jobs->spool, id)
		       ? is_lost(l, id,
				 "jobs.db has no row for it, and its folder has results but no copy of the row (order)",
				 e)
		       : 0; /* it was never accepted */
}

static int look_at(struct looking *l, uint64_t id, struct error *e)
{
	struct ledger_job j;
	struct row_file f;
	struct jobs *jobs = l->jobs;
	int rc = spool_read_record(jobs->spool, id, l->record, e);
	bool ended = rc == 0 && record_is_ended(l->record), bad_record = rc == -EBADMSG;
	if (rc && rc != -ENOENT && rc != -EBADMSG)
		return rc;
	int file = row_file_read(jobs->spool, id, &f, e);
	if (file && file != -ENOENT && file != -EBADMSG)
		return file;
	rc = ledger_get(jobs->ledger, id, &j, e);
	if (rc >= 0)
		rc = rc > 0 && !j.damaged ? with_row(l, &j, &f, file, ended, e)
					  : without_row(l, id, rc > 0, &f, file, ended, e);
	if (rc == 0 && bad_record && (rc = ledger_get(jobs->ledger, id, &j, e)) > 0)
		rc = !j.damaged && j.ended > 0 ? make_record(l, &j, e) : 0;
	row_file_free(&f);
	return rc;
}

static int look_at_folders(struct looking *l, struct error *e)
{
	uint64_t *ids;
	size_t count;
	int rc = spool_jobs(l->jobs->spool, &ids, &count, e);
	for (size_t i = 0; i < count && !rc; i++)
		rc = look_at(l, ids[i], e);
	mem_free(ids);
	return rc;
}

/* Rows without a folder: live jobs fail with a sentence (restore.h), ended ones are dropped. */
static int look_at_rows(struct looking *l, struct error *e)
{
	struct ledger_job j;
	char path[SPOOL_PATH_MAX];
	struct stat st;
	uint64_t id = 0;
	int rc;
	while ((rc = ledger_after(l->jobs->ledger, id, &j, e)) > 0) {
		l->last = id = j.id;
		spool_job_path(l->jobs->spool, id, NULL, path);
		if (j.damaged && disk_stat(path, &st) &&
		    (rc = is_lost(l, id, "its row in jobs.db is damaged, and its folder is missing", e)))
			return rc;
	}
	return rc;
}

/* ---- the database ---- */

static int put_database_aside(struct jobs *jobs, struct error *e)
{
	static const char *const ends[] = {"", "-wal", "-shm"};
	char from[SPOOL_PATH_MAX], to[SPOOL_PATH_MAX], folder[SPOOL_PATH_MAX];
	spool_path(jobs->spool, "", folder);
	for (int i = 0; i < 3; i++) {
		char name[64];
		snprintf(name, sizeof name, "jobs.db%s", ends[i]);
		spool_path(jobs->spool, name, from);
		snprintf(name, sizeof name, "jobs.db.damaged%s", ends[i]);
		spool_path(jobs->spool, name, to);
		if (disk_rename(from, to) && errno != ENOENT)
			return error_set(e, errno, "%s: %s", to, strerror(errno));
	}
	return disk_sync_folder(folder, e);
}

static int open_database(struct jobs *jobs, struct error *e)
{
	char path[SPOOL_PATH_MAX];
	spool_path(jobs->spool, "jobs.db", path);
	int rc = ledger_open(&jobs->ledger, path, e);
	if (rc != -EBADMSG)
		return rc;
	log_event(LOG_SPOOL_FAULT,
		  "text=%s action=\"it is kept as jobs.db.damaged, and made anew from the jobs' folders\"",
		  log_quote(e->text).text);
	rc = put_database_aside(jobs, e);
	return rc ? rc : ledger_open(&jobs->ledger, path, e);
}

int reconcile(struct jobs *jobs, struct error *e)
{
	struct looking l = {.jobs = jobs};
	l.names = (struct text){l.text, sizeof l.text};
	int rc = open_database(jobs, e);
	if (!rc && !(l.record = mem_alloc(1, sizeof *l.record)))
		rc = error_set(e, ENOMEM, "no memory for the jobs");
	if (!rc)
		rc = look_at_folders(&l, e);
	if (!rc)
		rc = look_at_rows(&l, e);
	mem_free(l.record);
	if (!rc)
		spool_skip_jobs(jobs->spool, l.last);
	if (rc || !l.lost || jobs->config.accept_loss)
		return rc;
	return error_set(
		e, EBADMSG,
		"%s has lost %llu job%s: %s%s. Nothing has been deleted. Put back what is missing, or start with "
		"--accept-loss: what is left of them is then moved to lost/ in the spool, and the other jobs continue",
		jobs->config.spool, (unsigned long long)l.lost, l.lost == 1 ? "" : "s", l.text,
		l.lost > NAMED_MOST ? ", ..." : "");
}

void reconcile_row(struct jobs *jobs, uint64_t job)
{
	struct ledger_job j;
	struct error e;
	int rc = ledger_get(jobs->ledger, job, &j, &e);
	if (rc > 0)
		rc = row_file_write(jobs->spool, &j, &e);
	if (rc < 0)
		log_fault(job, e.text);
}
