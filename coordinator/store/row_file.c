/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/store/row_file.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "common/base/checked_file.h"

#include <string.h>

enum { PIECES = 6 };
static const uint64_t piece_most = 1 << 26;
static const char magic[8] = "hsltO002";

/* As it lies in memory. Whoever changes it, or what follows it, counts the version up. */
struct head {
	char magic[8];
	uint64_t id, extended, revision;
	double submitted;
	int32_t priority, mixed;
	uint64_t sizes[PIECES]; /* owner, name, version, held, with their ends; submission, plan */
};

int row_file_write(const struct spool *s, const struct ledger_job *j, struct error *e)
{
	char name[SPOOL_PATH_MAX], temporary[SPOOL_PATH_MAX], folder[SPOOL_PATH_MAX];
	const void *pieces[PIECES] = {j->owner, j->name, j->version, j->held, j->submission, j->plan};
	struct checked_file out = {.buffer = NULL};
	struct head h = {.id = j->id,
			 .extended = j->extended,
			 .revision = j->revision,
			 .submitted = j->submitted,
			 .priority = j->priority,
			 .mixed = j->mixed,
			 .sizes = {strlen(j->owner) + 1, strlen(j->name) + 1, strlen(j->version) + 1,
				   strlen(j->held) + 1, j->submission_size, j->plan_size}};
	memcpy(h.magic, magic, sizeof magic);
	spool_job_path(s, j->id, "order", name);
	spool_job_path(s, j->id, "order.tmp", temporary);
	spool_job_path(s, j->id, NULL, folder);
	int rc = checked_file_create(&out, temporary, e);
	if (rc)
		return rc;
	rc = checked_file_write(&out, &h, sizeof h, e);
	for (int i = 0; i < PIECES && !rc; i++)
		rc = checked_file_write(&out, pieces[i], h.sizes[i], e);
	if (!rc)
		rc = checked_file_finish(&out, e);
	checked_file_close(&out);
	if (!rc)
		rc = spool_rename(temporary, name, folder, e);
	if (rc)
		disk_unlink(temporary);
	return rc;
}

static int read_pieces(struct checked_file *in, uint64_t job, struct row_file *out, struct error *e)
{
	struct head h;
	size_t all = 0, at = 0;
	char *piece[PIECES];
	int rc = checked_file_read(in, &h, sizeof h.magic, e);
	if (!rc)
		rc = spool_check_version(h.magic, magic, in->path, e);
	if (!rc)
		rc = checked_file_read(in, &h.id, sizeof h - sizeof h.magic, e);
	for (int i = 0; i < PIECES && !rc; i++) {
		if (h.sizes[i] == 0 || h.sizes[i] > piece_most || h.id != job)
			rc = error_set(e, EBADMSG, "%s: damaged", in->path);
		all += h.sizes[i];
	}
	if (!rc && !(out->memory = mem_alloc(all, 1)))
		rc = error_set(e, ENOMEM, "no memory for a job");
	if (!rc)
		rc = checked_file_read(in, out->memory, all, e);
	if (rc)
		return rc;
	for (int i = 0; i < PIECES; at += h.sizes[i++])
		piece[i] = out->memory + at;
	for (int i = 0; i < 4; i++)
		if (piece[i][h.sizes[i] - 1])
			return error_set(e, EBADMSG, "%s: damaged", in->path);
	out->job = (struct ledger_job){.id = h.id,
				       .owner = piece[0],
				       .name = piece[1],
				       .version = piece[2],
				       .held = piece[3],
				       .extended = h.extended,
				       .revision = h.revision,
				       .priority = h.priority,
				       .mixed = h.mixed,
				       .submitted = h.submitted,
				       .state = "live",
				       .submission = (unsigned char *)piece[4],
				       .plan = (unsigned char *)piece[5],
				       .submission_size = h.sizes[4],
				       .plan_size = h.sizes[5]};
	return 0;
}

int row_file_read(const struct spool *s, uint64_t job, struct row_file *out, struct error *e)
{
	char name[SPOOL_PATH_MAX];
	struct checked_file in;
	*out = (struct row_file){.memory = NULL};
	spool_job_path(s, job, "order", name);
	int rc = checked_file_open(&in, name, e);
	if (rc)
		return rc;
	rc = read_pieces(&in, job, out, e);
	checked_file_close(&in);
	if (rc)
		row_file_free(out);
	return rc;
}

void row_file_free(struct row_file *f)
{
	mem_free(f->memory);
	f->memory = NULL;
}
