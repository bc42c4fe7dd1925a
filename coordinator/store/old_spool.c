/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/store/old_spool.h"

#include "common/base/bytes.h"
#include "common/base/checked_file.h"
#include "common/base/disk.h"
#include "common/base/mem.h"
#include "coordinator/store/message.h"

#include <string.h>

enum { PIECE_COUNT = 6, OLD_HEAD_SIZE = 8 * (5 + PIECE_COUNT) /* bytes of the numbers after the magic number */ };
static const uint64_t max_piece_size = 1 << 26;
static const char magic[8] = "hsltO003", old_magic[8] = "hsltO002";

int old_spool_read_text(const char *path, size_t max_size, char **text, size_t *size, struct error *e)
{
	struct stat st;
	int fd = disk_open(path, O_RDONLY | O_CLOEXEC, 0);
	if (fd < 0 || disk_fstat(fd, &st)) {
		int rc = error_file(e, errno, path);
		if (fd >= 0)
			disk_close(fd);
		return rc;
	}
	size_t file_size = (size_t)st.st_size;
	char *bytes = file_size < max_size ? mem_alloc(file_size + 1, 1) : NULL;
	ssize_t n = 0;
	*size = 0;
	while (bytes && *size < file_size && (n = disk_read(fd, bytes + *size, file_size - *size)) > 0)
		*size += (size_t)n;
	int rc = file_size >= max_size ? error_set(e, EFBIG, "%s: too long", path)
		 : !bytes	       ? error_set(e, ENOMEM, "no memory to read %s", path)
		 : n < 0	       ? error_file(e, errno, path)
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
	if (in->remaining_bytes > PIECE_COUNT * max_piece_size)
		return error_set(e, EBADMSG, "%s: damaged", in->path);
	*size = (size_t)in->remaining_bytes;
	f->memory = mem_alloc(*size, 1);
	return f->memory ? checked_file_read(in, f->memory, *size, e) : error_set(e, ENOMEM, "no memory for a job");
}

static int parse_row(struct old_row *f, size_t size, const char *path, struct error *e)
{
	int rc;
	f->message = message_unpack(&stored__row__descriptor, f->memory, size, &rc, e);
	mem_free(f->memory);
	f->memory = NULL;
	if (rc || (rc = message_check_fields(f->message, e)))
		return error_prefix(e, rc, "%s", path);
	const Stored__Row *m = (const Stored__Row *)f->message;
	f->job = (struct ledger_job){.id = m->id,
				     .owner = m->owner,
				     .name = m->name,
				     .version = m->version,
				     .holder = m->held,
				     .extended = m->extended,
				     .revision = m->revision,
				     .priority = m->priority,
				     .is_mixed = m->mixed,
				     .submitted = m->submitted,
				     .submission = m->submission.data,
				     .plan = m->plan.data,
				     .submission_size = m->submission.len,
				     .plan_size = m->plan.len};
	return 0;
}

/* Reads a row of version 002. */
static int parse_old_row(struct old_row *f, size_t size, const char *path, struct error *e)
{
	const unsigned char *p = f->memory, *pieces[PIECE_COUNT];
	uint64_t sizes[PIECE_COUNT], offset = OLD_HEAD_SIZE;
	bool fits = size >= OLD_HEAD_SIZE;
	for (int i = 0; fits && i < PIECE_COUNT; offset += sizes[i++]) {
		sizes[i] = get64(p + 40 + 8 * i);
		pieces[i] = p + offset;
		fits = sizes[i] > 0 && sizes[i] <= size - offset && (i >= 4 || pieces[i][sizes[i] - 1] == 0);
	}
	if (!fits)
		return error_set(e, EBADMSG, "%s: damaged", path);
	f->job = (struct ledger_job){.id = get64(p),
				     .owner = (const char *)pieces[0],
				     .name = (const char *)pieces[1],
				     .version = (const char *)pieces[2],
				     .holder = (const char *)pieces[3],
				     .extended = get64(p + 8),
				     .revision = get64(p + 16),
				     .priority = (int)get32(p + 32),
				     .is_mixed = get32(p + 36) != 0,
				     .submitted = get_double(p + 24),
				     .submission = pieces[4],
				     .plan = pieces[5],
				     .submission_size = sizes[4],
				     .plan_size = sizes[5]};
	return 0;
}

static int read_row(struct checked_file *in, uint64_t job, struct old_row *f, struct error *e)
{
	char file_magic[sizeof magic];
	size_t size = 0;
	int rc = checked_file_read(in, file_magic, sizeof file_magic, e);
	bool older = !rc && memcmp(file_magic, old_magic, sizeof file_magic) == 0;
	if (!rc && !older)
		rc = spool_check_version(file_magic, magic, in->path, e);
	if (!rc)
		rc = read_rest(in, f, &size, e);
	if (!rc)
		rc = older ? parse_old_row(f, size, in->path, e) : parse_row(f, size, in->path, e);
	if (!rc && (f->job.id != job || !f->job.submission_size || !f->job.plan_size))
		rc = error_set(e, EBADMSG, "%s: damaged", in->path);
	f->job.state = "live";
	f->job.record = "";
	return rc;
}

int old_spool_read_row(const struct spool *s, uint64_t job, struct old_row *out, struct error *e)
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
