/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The coordinator's folder: its lock, the numbers of jobs, and files that are written atomically.
 *
 * spool_open takes the lock and creates missing folders. A number is written to next-job before a job gets it, so that
 * none is used twice; existing folders count, too. Files are written under a temporary name, flushed, renamed, and the
 * folder flushed.
 *
 * A second coordinator on the same folder is -EBUSY. A counter file without a number is -EBADMSG, a missing one is
 * derived from the folders. A failed write leaves the old file unchanged; a record that cannot be parsed is -EBADMSG, a
 * missing one -ENOENT.
 */
#include "coordinator/store/spool.h"

#include "common/base/disk.h"
#include "common/base/mem.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>

/* Size limit of a job's file; of a file in the spool's own folder: the quarantined workers, 64 per certificate, a
 * kilobyte each. */
enum { RECORD_MAX = 1 << 16, OWN_MAX = 1 << 28, FOLDER_MAX = SPOOL_PATH_MAX - 128 };

struct spool {
	char *folder, *blobs, *canvas;
	int lock;
	uint64_t next;
};

static char *join(const char *folder, const char *name)
{
	size_t size = strlen(folder) + strlen(name) + 2;
	char *path = mem_alloc(size, 1);
	if (path)
		snprintf(path, size, "%s/%s", folder, name);
	return path;
}

static int take_lock(struct spool *s, struct error *e)
{
	char *path = join(s->folder, "lock");
	if (!path)
		return error_set(e, ENOMEM, "no memory for the spool");
	s->lock = disk_open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
	int rc = 0;
	if (s->lock < 0)
		rc = error_set(e, errno, "%s: %s", path, strerror(errno));
	else if (disk_flock(s->lock, LOCK_EX | LOCK_NB))
		rc = errno == EWOULDBLOCK ? error_set(e, EBUSY, "%s: another coordinator uses this spool", s->folder)
					  : error_set(e, errno, "%s: %s", path, strerror(errno));
	mem_free(path);
	return rc;
}

/* folder/name gets these bytes, atomically. */
static int write_file(const char *folder, const char *name, const void *bytes, size_t size, struct error *e)
{
	char path[SPOOL_PATH_MAX], temporary[SPOOL_PATH_MAX + 8];
	snprintf(path, sizeof path, "%s/%s", folder, name);
	snprintf(temporary, sizeof temporary, "%s.tmp", path);
	int fd = disk_open(temporary, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
	int rc = fd < 0 ? -errno : disk_write_all(fd, bytes, size);
	if (!rc && disk_fsync(fd))
		rc = -errno;
	if (fd >= 0 && disk_close(fd) && !rc)
		rc = -errno;
	if (!rc && disk_rename(temporary, path))
		rc = -errno;
	if (rc) {
		if (fd >= 0)
			disk_unlink(temporary);
		return error_set(e, -rc, "%s: %s", path, strerror(-rc));
	}
	return disk_sync_folder(folder, e);
}

static int read_file(const char *path, size_t most, char **text, size_t *size, struct error *e)
{
	struct stat st;
	int fd = disk_open(path, O_RDONLY | O_CLOEXEC, 0);
	if (fd < 0 || disk_fstat(fd, &st)) {
		int rc = error_set(e, errno, "%s: %s", path, strerror(errno));
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
		 : n < 0       ? error_set(e, errno, "%s: %s", path, strerror(errno))
			       : 0;
	disk_close(fd);
	if (rc)
		mem_free(bytes);
	else
		*text = bytes;
	return rc;
}

/* ---- ids ---- */

static bool is_job_folder(const char *name, uint64_t *id)
{
	char again[32];
	char *end;
	if (name[0] != 'j')
		return false;
	*id = strtoull(name + 1, &end, 10);
	snprintf(again, sizeof again, "j%llu", (unsigned long long)*id);
	return *id && strcmp(again, name) == 0;
}

static int by_id(const void *a, const void *b)
{
	uint64_t x, y;
	memcpy(&x, a, sizeof x);
	memcpy(&y, b, sizeof y);
	return (x > y) - (x < y);
}

static bool add_id(uint64_t **ids, size_t count, uint64_t id)
{
	if ((count & (count - 1)) == 0) { /* grows at powers of two */
		uint64_t *more = mem_grow(*ids, count * sizeof *more, (count ? 2 * count : 1) * sizeof *more);
		if (!more)
			return false;
		*ids = more;
	}
	(*ids)[count] = id;
	return true;
}

int spool_jobs(const struct spool *s, uint64_t **ids, size_t *count, struct error *e)
{
	char path[SPOOL_PATH_MAX];
	uint64_t id;
	*ids = NULL;
	*count = 0;
	spool_path(s, "jobs", path);
	DIR *d = disk_opendir(path);
	if (!d)
		return error_set(e, errno, "%s: %s", path, strerror(errno));
	int rc = 0;
	for (struct dirent *f; !rc && (f = readdir(d));)
		if (is_job_folder(f->d_name, &id))
			rc = add_id(ids, *count, id) ? ++*count,
			0			     : error_set(e, ENOMEM, "%s: no memory for its list", path);
	closedir(d);
	if (rc) {
		mem_free(*ids);
		*ids = NULL;
		*count = 0;
	}
	if (*count)
		qsort(*ids, *count, sizeof **ids, by_id);
	return rc;
}

static int read_counter(struct spool *s, struct error *e)
{
	char *path = join(s->folder, "next-job"), *text;
	size_t size, count;
	uint64_t *ids;
	s->next = 1;
	if (!path)
		return error_set(e, ENOMEM, "no memory for the spool");
	int rc = read_file(path, RECORD_MAX, &text, &size, e);
	if (!rc) {
		unsigned long long n = 0;
		char digits[24] = "";
		memcpy(digits, text, size < sizeof digits ? size : sizeof digits - 1);
		if (sscanf(digits, "%llu", &n) != 1 || n == 0)
			rc = error_set(e, EBADMSG, "%s: no job number in it", path);
		s->next = n;
		mem_free(text);
	} else if (rc == -ENOENT) {
		rc = 0;
	}
	mem_free(path);
	if (rc || (rc = spool_jobs(s, &ids, &count, e)))
		return rc;
	if (count && ids[count - 1] >= s->next)
		s->next = ids[count - 1] + 1;
	mem_free(ids);
	return 0;
}

/* ---- start and end ---- */

int spool_open(struct spool **out, const char *folder, struct error *e)
{
	if (strlen(folder) > FOLDER_MAX)
		return error_set(e, ENAMETOOLONG, "%s: the name is too long", folder);
	struct spool *s = mem_alloc(1, sizeof *s);
	if (!s)
		return error_set(e, ENOMEM, "no memory for the spool");
	s->lock = -1;
	s->folder = mem_strdup(folder);
	s->blobs = join(folder, "blobs");
	s->canvas = join(folder, "canvas");
	char *jobs = join(folder, "jobs");
	int rc = !s->folder || !s->blobs || !s->canvas || !jobs ? error_set(e, ENOMEM, "no memory for the spool")
								: disk_make_folder(folder, e);
	if (!rc)
		rc = take_lock(s, e);
	if (!rc)
		rc = disk_make_folder(jobs, e);
	if (!rc)
		rc = disk_make_folder(s->canvas, e);
	if (!rc)
		rc = read_counter(s, e);
	mem_free(jobs);
	if (rc)
		spool_close(s);
	else
		*out = s;
	return rc;
}

void spool_close(struct spool *s)
{
	if (!s)
		return;
	if (s->lock >= 0)
		disk_close(s->lock);
	mem_free(s->folder);
	mem_free(s->blobs);
	mem_free(s->canvas);
	mem_free(s);
}

uint64_t spool_next_job(const struct spool *s)
{
	return s->next;
}

void spool_skip_jobs(struct spool *s, uint64_t id)
{
	if (id >= s->next && id < UINT64_MAX / 2)
		s->next = id + 1;
}

int spool_take_job(struct spool *s, uint64_t id, struct error *e)
{
	char text[32], path[SPOOL_PATH_MAX];
	int n = snprintf(text, sizeof text, "%llu\n", (unsigned long long)id + 1);
	if (id >= s->next) {
		int rc = write_file(s->folder, "next-job", text, (size_t)n, e);
		if (rc)
			return rc;
		s->next = id + 1;
	}
	spool_job_path(s, id, NULL, path);
	return disk_make_folder(path, e);
}

const char *spool_blobs(const struct spool *s)
{
	return s->blobs;
}

const char *spool_canvas(const struct spool *s)
{
	return s->canvas;
}

void spool_path(const struct spool *s, const char *name, char path[SPOOL_PATH_MAX])
{
	snprintf(path, SPOOL_PATH_MAX, "%s/%s", s->folder, name);
}

void spool_job_path(const struct spool *s, uint64_t id, const char *file, char path[SPOOL_PATH_MAX])
{
	snprintf(path, SPOOL_PATH_MAX, "%s/jobs/j%llu%s%s", s->folder, (unsigned long long)id, file ? "/" : "",
		 file ? file : "");
}

int spool_write(const struct spool *s, uint64_t id, const char *file, const void *bytes, size_t size, struct error *e)
{
	char path[SPOOL_PATH_MAX];
	spool_job_path(s, id, NULL, path);
	return write_file(path, file, bytes, size, e);
}

int spool_write_own(const struct spool *s, const char *file, const void *bytes, size_t size, struct error *e)
{
	return write_file(s->folder, file, bytes, size, e);
}

int spool_read_own(const struct spool *s, const char *file, char **text, size_t *size, struct error *e)
{
	char path[SPOOL_PATH_MAX];
	spool_path(s, file, path);
	return read_file(path, OWN_MAX, text, size, e);
}

int spool_rename(const char *from, const char *to, const char *folder, struct error *e)
{
	return disk_rename(from, to) ? error_set(e, errno, "%s: %s", to, strerror(errno)) : disk_sync_folder(folder, e);
}

int spool_check_version(const char got[8], const char known[8], const char *path, struct error *e)
{
	enum { NAME = 5, DIGITS = 3 };
	bool same = memcmp(got, known, NAME) == 0;
	for (int i = NAME; i < NAME + DIGITS; i++)
		same = same && got[i] >= '0' && got[i] <= '9';
	if (!same)
		return error_set(e, EBADMSG, "%s: damaged", path);
	if (memcmp(got + NAME, known + NAME, DIGITS) == 0)
		return 0;
	return error_set(e, EPROTO,
			 "%s has version %.3s, and this coordinator knows version %.3s: another one wrote it", path,
			 got + NAME, known + NAME);
}

int spool_write_record(const struct spool *s, const struct job_record *r, struct error *e)
{
	char *text;
	int rc = record_to_json(r, &text, e);
	if (rc)
		return rc;
	rc = spool_write(s, r->id, "job.json", text, strlen(text), e);
	mem_free(text);
	return rc;
}

int spool_read_record(const struct spool *s, uint64_t id, struct job_record *r, struct error *e)
{
	char path[SPOOL_PATH_MAX], *text;
	size_t size;
	spool_job_path(s, id, "job.json", path);
	int rc = read_file(path, RECORD_MAX, &text, &size, e);
	if (rc)
		return rc == -ENOENT ? error_set(e, ENOENT, "there is no job j%llu", (unsigned long long)id) : rc;
	rc = record_from_json(text, size, r, e);
	mem_free(text);
	if (!rc && r->id != id)
		rc = error_set(e, EBADMSG, "the record of another job");
	return rc ? error_prefix(e, rc, "%s", path) : 0;
}

void spool_drop_job(const struct spool *s, uint64_t id)
{
	char path[SPOOL_PATH_MAX];
	spool_job_path(s, id, NULL, path);
	DIR *d = disk_opendir(path);
	for (struct dirent *f; d && (f = readdir(d));) {
		if (strcmp(f->d_name, ".") == 0 || strcmp(f->d_name, "..") == 0 || strcmp(f->d_name, "job.json") == 0)
			continue;
		spool_job_path(s, id, f->d_name, path);
		disk_unlink(path);
	}
	if (d)
		closedir(d);
	spool_job_path(s, id, "job.json", path);
	disk_unlink(path);
	spool_job_path(s, id, NULL, path);
	disk_rmdir(path);
}
