/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Moves the files of earlier versions into the ledger: the notes of the spool, then job by job its record (job.json)
 * and the copy of its row (order).
 *
 * An undamaged row counts, unless its copy has a higher revision. A missing or damaged row is made from its copy or,
 * if the job has ended, from its record. The record says whether the job has ended: it was written before the row. A
 * job of which neither row nor copy is left keeps its files, and is reported as lost (reconcile.h).
 *
 * A damaged record is kept as job.json.damaged and replaced by one made from the row, with a note. An error of the
 * machine, or a file of another version, ends the import.
 */
#include "coordinator/jobs/import.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/store/old_spool.h"

#include <stdlib.h>

enum { RECORD_BYTES_MAX = 1 << 16, NOTE_BYTES_MAX = 1 << 28 };
static const char record_file[] = "job.json", row_file[] = "order";

static int import_note(struct jobs *jobs, const char *file, const char *name, struct error *e)
{
	char path[SPOOL_PATH_MAX], *text;
	size_t size;
	spool_path(jobs->spool, file, path);
	int rc = old_spool_read_text(path, NOTE_BYTES_MAX, &text, &size, e);
	if (rc)
		return rc == -ENOENT ? 0 : rc;
	rc = ledger_set_note(jobs->ledger, name, text, e);
	mem_free(text);
	if (!rc)
		disk_unlink(path);
	return rc;
}

static int import_counter(struct jobs *jobs, struct error *e)
{
	char path[SPOOL_PATH_MAX], *text;
	size_t size;
	spool_path(jobs->spool, "next-job", path);
	int rc = old_spool_read_text(path, RECORD_BYTES_MAX, &text, &size, e);
	if (rc)
		return rc == -ENOENT ? 0 : rc;
	uint64_t next = strtoull(text, NULL, 10);
	mem_free(text);
	if (!next)
		return error_set(e, EBADMSG, "%s: no job number in it", path);
	rc = ledger_skip_ids(jobs->ledger, next - 1, e);
	if (!rc)
		disk_unlink(path);
	return rc;
}

struct old_job {
	char *record_text; /* NULL: none, or damaged */
	bool is_record_damaged;
	struct job_record record; /* valid if there is a text */
	struct old_row row;	  /* copy of the row; its id is 0 if there is none, or it is damaged */
};

static int read_record(const struct jobs *jobs, uint64_t id, struct old_job *old, struct error *e)
{
	char path[SPOOL_PATH_MAX];
	size_t size;
	spool_job_path(jobs->spool, id, record_file, path);
	int rc = old_spool_read_text(path, RECORD_BYTES_MAX, &old->record_text, &size, e);
	if (rc)
		return rc == -ENOENT ? 0 : rc;
	rc = record_from_json(old->record_text, size, &old->record, e);
	if (!rc && old->record.id == id)
		return 0;
	mem_free(old->record_text);
	old->record_text = NULL;
	old->is_record_damaged = true;
	return rc == -EBADMSG ? 0 : rc;
}

static int read_old_job(const struct jobs *jobs, uint64_t id, struct old_job *old, struct error *e)
{
	int rc = read_record(jobs, id, old, e);
	if (rc)
		return rc;
	rc = old_spool_read_row(jobs->spool, id, &old->row, e);
	return rc == -ENOENT || rc == -EBADMSG ? 0 : rc;
}

/* Makes the row of a job that has ended from its record. */
static void row_from_record(const struct job_record *r, struct ledger_job *j)
{
	*j = (struct ledger_job){.id = r->id,
				 .owner = r->owner,
				 .name = r->name,
				 .version = "",
				 .holder = "",
				 .extended = r->extended,
				 .priority = r->priority,
				 .submitted = r->submitted};
}

static void set_end(struct ledger_job *j, const struct old_job *old)
{
	j->state = old->record.state;
	j->end_time = old->record.ended > 0 ? old->record.ended : 1;
	j->holder = "";
	j->submission = old->row.job.submission; /* present as long as the job's films are */
	j->submission_size = old->row.job.submission_size;
	j->plan = old->row.job.plan;
	j->plan_size = old->row.job.plan_size;
}

/* Makes a record for an ended job whose record is damaged, so that the job is listed and its image can be fetched. */
static int make_record(const struct jobs *jobs, struct ledger_job *j, struct old_job *old, struct error *e)
{
	struct job_record *r = &old->record;
	char path[SPOOL_PATH_MAX];
	struct stat st;
	record_init(r, j->id, j->name, j->owner);
	text_copy(r->state, sizeof r->state, j->state);
	r->priority = j->priority;
	r->extended = j->extended;
	r->submitted = j->submitted;
	r->ended = j->end_time;
	spool_job_path(jobs->spool, j->id, "result.exr", path);
	r->has_result = disk_stat(path, &st) == 0;
	r->exit_code = r->has_result ? 0 : 3;
	r->progress = r->has_result;
	record_add_note(r, "its record (job.json) was damaged: what it counted and estimated is lost");
	log_event(
		LOG_SPOOL_FAULT,
		"job=j%llu text=\"its record (job.json) was damaged: kept as job.json.damaged, and restored from jobs.db\"",
		(unsigned long long)j->id);
	return record_to_json(r, &old->record_text, e);
}

static int store_row(struct jobs *jobs, uint64_t id, struct old_job *old, struct error *e)
{
	struct ledger_job j;
	int rc = ledger_read_row(jobs->ledger, id, &j, e);
	bool ended = old->record_text && record_is_ended(&old->record);
	if (rc < 0 || (rc > 0 && !j.is_damaged && *j.record)) /* imported before */
		return rc < 0 ? rc : 0;
	uint64_t revision = rc > 0 && !j.is_damaged ? j.revision : 0;
	if (old->row.job.id && (rc == 0 || j.is_damaged || old->row.job.revision > revision))
		j = old->row.job;
	else if ((rc == 0 || j.is_damaged) && ended)
		row_from_record(&old->record, &j);
	else if (rc == 0 || j.is_damaged)
		return -ENOENT;
	j.revision = j.revision > revision ? j.revision : revision;
	if (ended && old->record.extended == j.extended)
		set_end(&j, old);
	rc = !old->record_text && j.end_time > 0 ? make_record(jobs, &j, old, e) : 0;
	j.revision++;
	j.record = old->record_text ? old->record_text : "";
	return rc ? rc : ledger_write_row(jobs->ledger, &j, e);
}

static int import_job(struct jobs *jobs, uint64_t id, struct old_job *old, struct error *e)
{
	char path[SPOOL_PATH_MAX], damaged_path[SPOOL_PATH_MAX];
	*old = (struct old_job){.record_text = NULL};
	int rc = read_old_job(jobs, id, old, e);
	if (!rc && (old->record_text || old->is_record_damaged || old->row.job.id))
		rc = store_row(jobs, id, old, e);
	else if (!rc)
		rc = -ENOENT;
	mem_free(old->record_text);
	old_spool_row_free(&old->row);
	if (rc)
		return rc == -ENOENT ? 0 : rc;
	spool_job_path(jobs->spool, id, record_file, path);
	spool_job_path(jobs->spool, id, "job.json.damaged", damaged_path);
	if (!old->is_record_damaged || disk_rename(path, damaged_path))
		disk_unlink(path);
	spool_job_path(jobs->spool, id, row_file, path);
	disk_unlink(path);
	return 0;
}

int import_files(struct jobs *jobs, struct error *e)
{
	uint64_t *ids = NULL;
	size_t count = 0;
	struct old_job *old = mem_alloc(1, sizeof *old);
	int rc = old ? import_counter(jobs, e) : error_set(e, ENOMEM, "no memory for the jobs");
	if (!rc)
		rc = import_note(jobs, "clock", "clock", e);
	if (!rc)
		rc = import_note(jobs, "aside", "quarantined", e);
	if (!rc)
		rc = spool_list_jobs(jobs->spool, &ids, &count, e);
	for (size_t i = 0; i < count && !rc; i++)
		rc = import_job(jobs, ids[i], old, e);
	mem_free(ids);
	mem_free(old);
	return rc;
}
