/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The file is a magic number and a message Row, with a checksum (common/base/checked_file.h). Files of version 002 are
 * read, too: numbers, the sizes of texts and frames, then these, texts with their final 0.
 */
#include "coordinator/store/row_file.h"

#include "common/base/bytes.h"
#include "common/base/checked_file.h"
#include "common/base/disk.h"
#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/store/message.h"

#include <string.h>

enum { PIECES = 6, OLD_HEAD = 8 * (5 + PIECES) /* after the magic number */ };
static const uint64_t piece_most = 1 << 26;
static const char magic[8] = "hsltO003", old_magic[8] = "hsltO002";

static ProtobufCBinaryData borrow(const unsigned char *bytes, size_t size)
{
	return (ProtobufCBinaryData){size, (uint8_t *)text_borrow((const char *)bytes)};
}

static int write_row(const struct ledger_job *j, struct checked_file *out, struct error *e)
{
	Stored__Row m;
	stored__row__init(&m);
	m.id = j->id;
	m.extended = j->extended;
	m.revision = j->revision;
	m.submitted = j->submitted;
	m.priority = j->priority;
	m.mixed = j->mixed;
	m.owner = text_borrow(j->owner);
	m.name = text_borrow(j->name);
	m.version = text_borrow(j->version);
	m.held = text_borrow(j->held);
	m.submission = borrow(j->submission, j->submission_size);
	m.plan = borrow(j->plan, j->plan_size);
	size_t size = stored__row__get_packed_size(&m);
	unsigned char *bytes = mem_alloc(size, 1);
	if (!bytes)
		return error_set(e, ENOMEM, "no memory for a job");
	stored__row__pack(&m, bytes);
	int rc = checked_file_write(out, magic, sizeof magic, e);
	if (!rc)
		rc = checked_file_write(out, bytes, size, e);
	mem_free(bytes);
	return rc;
}

int row_file_write(const struct spool *s, const struct ledger_job *j, struct error *e)
{
	char name[SPOOL_PATH_MAX], temporary[SPOOL_PATH_MAX], folder[SPOOL_PATH_MAX];
	struct checked_file out = {.buffer = NULL};
	spool_job_path(s, j->id, "order", name);
	spool_job_path(s, j->id, "order.tmp", temporary);
	spool_job_path(s, j->id, NULL, folder);
	int rc = checked_file_create(&out, temporary, e);
	if (rc)
		return rc;
	rc = write_row(j, &out, e);
	if (!rc)
		rc = checked_file_finish(&out, e);
	checked_file_close(&out);
	if (!rc)
		rc = spool_rename(temporary, name, folder, e);
	if (rc)
		disk_unlink(temporary);
	return rc;
}

/* Reads the rest of the file into f->memory. */
static int read_rest(struct checked_file *in, struct row_file *f, size_t *size, struct error *e)
{
	if (in->left > PIECES * piece_most)
		return error_set(e, EBADMSG, "%s: damaged", in->path);
	*size = (size_t)in->left;
	f->memory = mem_alloc(*size, 1);
	return f->memory ? checked_file_read(in, f->memory, *size, e) : error_set(e, ENOMEM, "no memory for a job");
}

static int take_row(struct row_file *f, size_t size, const char *path, struct error *e)
{
	int rc;
	f->message = message_unpack(&stored__row__descriptor, f->memory, size, &rc, e);
	mem_free(f->memory);
	f->memory = NULL;
	if (rc || (rc = message_check_known(f->message, e)))
		return error_prefix(e, rc, "%s", path);
	const Stored__Row *m = (const Stored__Row *)f->message;
	f->job = (struct ledger_job){.id = m->id,
				     .owner = m->owner,
				     .name = m->name,
				     .version = m->version,
				     .held = m->held,
				     .extended = m->extended,
				     .revision = m->revision,
				     .priority = m->priority,
				     .mixed = m->mixed,
				     .submitted = m->submitted,
				     .submission = m->submission.data,
				     .plan = m->plan.data,
				     .submission_size = m->submission.len,
				     .plan_size = m->plan.len};
	return 0;
}

/* Of version 002. */
static int take_old_row(struct row_file *f, size_t size, const char *path, struct error *e)
{
	const unsigned char *p = f->memory, *piece[PIECES];
	uint64_t sizes[PIECES], at = OLD_HEAD;
	bool fits = size >= OLD_HEAD;
	for (int i = 0; fits && i < PIECES; at += sizes[i++]) {
		sizes[i] = get64(p + 40 + 8 * i);
		piece[i] = p + at;
		fits = sizes[i] > 0 && sizes[i] <= size - at && (i >= 4 || piece[i][sizes[i] - 1] == 0);
	}
	if (!fits)
		return error_set(e, EBADMSG, "%s: damaged", path);
	f->job = (struct ledger_job){.id = get64(p),
				     .owner = (const char *)piece[0],
				     .name = (const char *)piece[1],
				     .version = (const char *)piece[2],
				     .held = (const char *)piece[3],
				     .extended = get64(p + 8),
				     .revision = get64(p + 16),
				     .priority = (int)get32(p + 32),
				     .mixed = get32(p + 36) != 0,
				     .submitted = get_double(p + 24),
				     .submission = piece[4],
				     .plan = piece[5],
				     .submission_size = sizes[4],
				     .plan_size = sizes[5]};
	return 0;
}

static int read_row(struct checked_file *in, uint64_t job, struct row_file *f, struct error *e)
{
	char got[sizeof magic];
	size_t size = 0;
	int rc = checked_file_read(in, got, sizeof got, e);
	bool old = !rc && memcmp(got, old_magic, sizeof got) == 0;
	if (!rc && !old)
		rc = spool_check_version(got, magic, in->path, e);
	if (!rc)
		rc = read_rest(in, f, &size, e);
	if (!rc)
		rc = old ? take_old_row(f, size, in->path, e) : take_row(f, size, in->path, e);
	if (!rc && (f->job.id != job || !f->job.submission_size || !f->job.plan_size))
		rc = error_set(e, EBADMSG, "%s: damaged", in->path);
	f->job.state = "live";
	return rc;
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
	rc = read_row(&in, job, out, e);
	checked_file_close(&in);
	if (rc)
		row_file_free(out);
	return rc;
}

void row_file_free(struct row_file *f)
{
	message_free(f->message);
	mem_free(f->memory);
	f->message = NULL;
	f->memory = NULL;
}
