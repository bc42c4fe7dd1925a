/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/store/old_spool.h"

#include "common/base/bytes.h"
#include "common/base/checked_file.h"
#include "common/base/disk.h"
#include "common/base/mem.h"
#include "coordinator/store/message.h"

#include <string.h>

enum { PIECES = 6, OLD_HEAD = 8 * (5 + PIECES) /* bytes of the numbers after the magic number */ };
static const uint64_t piece_most = 1 << 26;
static const char magic[8] = "hsltO003", old_magic[8] = "hsltO002";

int old_spool_text(const char *path, size_t most, char **text, size_t *size, struct error *e)
{
	struct stat st;
	int fd = disk_open(path, O_RDONLY | O_CLOEXEC, 0);
	if (fd < 0 || disk_fstat(fd, &st)) {
		int rc = error_file(e, errno, path);
		if (fd >= 0)
			disk_close(fd);
		return rc;
	}
	size_t there = (size_t)st.st_size;
	char *bytes = there < most ? mem_alloc(there + 1, 1) : NULL;
	ssize_t n = 0;
	*size = 0;
	while (bytes && *size < there && (n = disk_read(fd, bytes + *size, there - *size)) > 0)
		*size += (size_t)n;
	int rc = there >= most ? error_set(e, EFBIG, "%s: too long", path)
		 : !bytes      ? error_set(e, ENOMEM, "no memory to read %s", path)
		 : n < 0       ? error_file(e, errno, path)
			       : 0;
	disk_close(fd);
	if (rc)
		mem_free(bytes);
	else
		*text = bytes;
	return rc;
}

/* Reads the rest of the file into f->memory, and returns its size. */
static int read_rest(struct checked_file *in, struct old_row *f, size_t *size, struct error *e)
{
	if (in->left > PIECES * piece_most)
		return error_set(e, EBADMSG, "%s: damaged", in->path);
	*size = (size_t)in->left;
	f->memory = mem_alloc(*size, 1);
	return f->memory ? checked_file_read(in, f->memory, *size, e) : error_set(e, ENOMEM, "no memory for a job");
}

static int take_row(struct old_row *f, size_t size, const char *path, struct error *e)
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

/* Reads a row of version 002. */
static int take_old_row(struct old_row *f, size_t size, const char *path, struct error *e)
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

static int read_row(struct checked_file *in, uint64_t job, struct old_row *f, struct error *e)
{
	char got[sizeof magic];
	size_t size = 0;
	int rc = checked_file_read(in, got, sizeof got, e);
	bool older = !rc && memcmp(got, old_magic, sizeof got) == 0;
	if (!rc && !older)
		rc = spool_check_version(got, magic, in->path, e);
	if (!rc)
		rc = read_rest(in, f, &size, e);
	if (!rc)
		rc = older ? take_old_row(f, size, in->path, e) : take_row(f, size, in->path, e);
	if (!rc && (f->job.id != job || !f->job.submission_size || !f->job.plan_size))
		rc = error_set(e, EBADMSG, "%s: damaged", in->path);
	f->job.state = "live";
	f->job.record = "";
	return rc;
}

int old_spool_row(const struct spool *s, uint64_t job, struct old_row *out, struct error *e)
{
	char name[SPOOL_PATH_MAX];
	struct checked_file in;
	*out = (struct old_row){.memory = NULL};
	spool_job_path(s, job, "order", name);
	int rc = checked_file_open(&in, name, e);
	if (rc)
		return rc;
	rc = read_row(&in, job, out, e);
	checked_file_close(&in);
	if (rc) {
		old_spool_row_free(out);
		out->job.id = 0;
	}
	return rc;
}

void old_spool_row_free(struct old_row *f)
{
	message_free(f->message);
	mem_free(f->memory);
	f->message = NULL;
	f->memory = NULL;
}
