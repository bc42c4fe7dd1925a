#include "coordinator/shell/keep.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "common/base/sealed.h"
#include "coordinator/shell/durable.h"

#include <stdio.h>
#include <string.h>

enum { FRAME_MOST = 1 << 26 };

static int write_piece(struct sealed *out, const void *bytes, size_t size, struct error *e)
{
	uint64_t n = size;
	int rc = sealed_write(out, &n, sizeof n, e);
	return rc ? rc : sealed_write(out, bytes, size, e);
}

static int write_order(const struct server *s, const struct order *o, struct error *e)
{
	char name[SPOOL_PATH_MAX], temporary[SPOOL_PATH_MAX], folder[SPOOL_PATH_MAX];
	struct ledger_job j = {.id = o->id};
	struct sealed out = {.buffer = NULL};
	unsigned char *submission = NULL, *plan = NULL;
	spool_job_path(s->spool, o->id, "order", name);
	spool_job_path(s->spool, o->id, "order.tmp", temporary);
	spool_job_path(s->spool, o->id, NULL, folder);
	int rc = durable_pack(o, &j, &submission, &plan, e);
	bool begun = !rc && (rc = sealed_create(&out, temporary, e)) == 0;
	if (!rc)
		rc = write_piece(&out, submission, j.submission_size, e);
	if (!rc)
		rc = write_piece(&out, plan, j.plan_size, e);
	if (!rc)
		rc = sealed_finish(&out, e);
	if (begun)
		sealed_close(&out);
	if (!rc)
		rc = spool_rename(temporary, name, folder, e);
	if (rc)
		disk_unlink(temporary);
	mem_free(submission);
	mem_free(plan);
	return rc;
}

bool keep_order(struct server *s, const struct order *o)
{
	struct error e;
	if (!s->config.keep_bytes || !o->canvas || o->lit.black || canvas_rounds(o->canvas) == 0 ||
	    (strcmp(o->record.state, job_state_name(JOB_DONE)) != 0 && !o->overflowed))
		return false;
	if (write_order(s, o, &e) == 0)
		return true;
	log_event(LOG_SPOOL_FAULT, "job=j%llu text=%s", (unsigned long long)o->id, log_quote(e.text).text);
	return false;
}

void keep_drop(const struct server *s, uint64_t job)
{
	char path[SPOOL_PATH_MAX];
	if (s->reading && s->reading->id == job)
		return;
	spool_job_path(s->spool, job, NULL, path);
	journal_clear(path, UINT64_MAX);
	spool_job_path(s->spool, job, "checkpoint", path);
	disk_unlink(path);
	spool_job_path(s->spool, job, "order", path);
	disk_unlink(path);
}

uint64_t keep_bytes(const struct server *s, uint64_t job)
{
	char folder[SPOOL_PATH_MAX], path[SPOOL_PATH_MAX];
	uint64_t sum = 0;
	struct stat st;
	spool_job_path(s->spool, job, NULL, folder);
	DIR *d = disk_opendir(folder);
	for (struct dirent *f; d && (f = readdir(d));) {
		if (strcmp(f->d_name, "order") != 0 && strcmp(f->d_name, "checkpoint") != 0 && strncmp(f->d_name, "journal.", 8) != 0)
			continue;
		spool_job_path(s->spool, job, f->d_name, path);
		sum += disk_stat(path, &st) == 0 ? (uint64_t)st.st_size : 0;
	}
	if (d)
		closedir(d);
	return sum;
}

bool keep_drop_all(const struct server *s)
{
	bool any = false;
	for (size_t i = 0; i < s->ended_count; i++)
		if (keep_bytes(s, s->ended[i].id)) {
			keep_drop(s, s->ended[i].id);
			any = true;
		}
	return any;
}

void keep_trim(const struct server *s)
{
	uint64_t left = s->config.keep_bytes;
	for (size_t i = s->ended_count; i-- > 0;) { /* the latest ones first */
		uint64_t bytes = keep_bytes(s, s->ended[i].id);
		if (bytes > left)
			keep_drop(s, s->ended[i].id);
		else
			left -= bytes;
	}
}

static int read_piece(struct sealed *in, unsigned char **bytes, size_t *size, struct error *e)
{
	uint64_t n;
	int rc = sealed_read(in, &n, sizeof n, e);
	if (!rc && (n == 0 || n > FRAME_MOST))
		rc = error_set(e, EBADMSG, "%s: a piece of %llu bytes", in->path, (unsigned long long)n);
	if (!rc && !(*bytes = mem_alloc(n, 1)))
		rc = error_set(e, ENOMEM, "no memory for a job");
	*size = (size_t)(rc ? 0 : n);
	return rc ? rc : sealed_read(in, *bytes, *size, e);
}

int keep_read(const struct server *s, uint64_t job, struct ledger_job *j, struct error *e)
{
	char name[SPOOL_PATH_MAX];
	struct sealed in;
	unsigned char *submission = NULL, *plan = NULL;
	spool_job_path(s->spool, job, "order", name);
	int rc = sealed_open(&in, name, e);
	if (rc)
		return rc;
	rc = read_piece(&in, &submission, &j->submission_size, e);
	if (!rc)
		rc = read_piece(&in, &plan, &j->plan_size, e);
	sealed_close(&in);
	j->submission = submission;
	j->plan = plan;
	if (rc) {
		mem_free(submission);
		mem_free(plan);
	}
	return rc;
}
