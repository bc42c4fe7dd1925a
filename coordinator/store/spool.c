/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The coordinator's folder: its lock, the jobs' folders, and files that are written atomically.
 *
 * spool_open takes the lock and creates missing folders. A file is written under a temporary name, flushed and
 * renamed; then the folder is flushed. A second coordinator on the same folder gets -EBUSY. A failed write leaves the
 * old file unchanged.
 */
#include "coordinator/store/spool.h"

#include "common/base/disk.h"
#include "common/base/list.h"
#include "common/base/mem.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>

enum { FOLDER_MAX = SPOOL_PATH_MAX - 128 };

struct spool {
	char *folder, *blobs, *canvas;
	int lock;
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
		rc = error_file(e, errno, path);
	else if (disk_flock(s->lock, LOCK_EX | LOCK_NB))
		rc = errno == EWOULDBLOCK ? error_set(e, EBUSY, "%s: another coordinator uses this spool", s->folder)
					  : error_file(e, errno, path);
	mem_free(path);
	return rc;
}

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
	uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
	return (x > y) - (x < y);
}

int spool_jobs(const struct spool *s, uint64_t **ids, size_t *count, struct error *e)
{
	char path[SPOOL_PATH_MAX];
	uint64_t id;
	*ids = NULL;
	*count = 0;
	spool_path(s, "jobs", path);
	struct disk_list l;
	int rc = 0;
	disk_list_begin(&l, path);
	for (const char *name; !rc && (name = disk_list_next(&l));) {
		if (!is_job_folder(name, &id))
			continue;
		uint64_t *more = list_room(*ids, *count, sizeof *more);
		if (more)
			(*ids = more)[(*count)++] = id;
		else
			rc = error_set(e, ENOMEM, "%s: no memory for its list", path);
	}
	rc = disk_list_end(&l, rc, e);
	if (rc) {
		mem_free(*ids);
		*ids = NULL;
		*count = 0;
	}
	if (*count)
		qsort(*ids, *count, sizeof **ids, by_id);
	return rc;
}

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

void spool_reserve(const struct spool *s)
{
	char path[SPOOL_PATH_MAX];
	struct stat st;
	spool_path(s, "reserve", path);
	if (disk_stat(path, &st) == 0 ? st.st_size == SPOOL_RESERVE : disk_available(s->folder) < 4 * SPOOL_RESERVE)
		return;
	int fd = disk_open(path, O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
	if (fd < 0)
		return;
	bool made = disk_posix_fallocate(fd, 0, SPOOL_RESERVE) == 0;
	disk_close(fd);
	if (!made)
		disk_unlink(path);
}

bool spool_use_reserve(const struct spool *s)
{
	char path[SPOOL_PATH_MAX];
	spool_path(s, "reserve", path);
	return disk_unlink(path) == 0;
}

int spool_make_job(const struct spool *s, uint64_t id, struct error *e)
{
	char path[SPOOL_PATH_MAX];
	spool_job_path(s, id, NULL, path);
	return disk_make_folder(path, e);
}

int spool_holds(const struct spool *s, uint64_t bytes, struct error *e)
{
	uint64_t capacity = disk_capacity(s->folder);
	if (!capacity || bytes <= capacity)
		return 0;
	return error_set(e, ENOSPC,
			 "it may need %.3g MB for its files and films, and the disk of the coordinator's spool has "
			 "%.3g MB in all: a smaller --size or --crop, or less --groups",
			 1e-6 * (double)bytes, 1e-6 * (double)capacity);
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
	spool_job_path(s, id, file, path);
	int rc = disk_replace(path, bytes, size, 0600, e);
	if (rc)
		return rc;
	spool_job_path(s, id, NULL, path);
	return disk_sync_folder(path, e);
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
			 "%s has version %.3s, and this coordinator reads version %.3s: another release wrote it", path,
			 got + NAME, known + NAME);
}

int spool_film_bytes(const struct spool *s, uint64_t id, unsigned checkpoints, uint64_t *bytes, struct error *e)
{
	char folder[SPOOL_PATH_MAX], path[SPOOL_PATH_MAX];
	struct disk_list l;
	struct stat st;
	int rc = 0;
	*bytes = 0;
	spool_job_path(s, id, NULL, folder);
	disk_list_begin(&l, folder);
	for (const char *name; (name = disk_list_next(&l));) {
		bool checkpoint = strcmp(name, "checkpoint") == 0;
		if (!checkpoint && strncmp(name, "journal.", 8) != 0)
			continue;
		spool_job_path(s, id, name, path);
		if (disk_stat(path, &st) == 0)
			*bytes += (uint64_t)st.st_size * (checkpoint ? checkpoints : 1);
		else if (errno != ENOENT) /* ENOENT: deleted meanwhile */
			rc = error_file(e, errno, path);
	}
	rc = disk_list_end(&l, rc, e);
	return rc == -ENOENT ? 0 : rc; /* without a folder there are no films */
}

int spool_drop_job(const struct spool *s, uint64_t id, struct error *e)
{
	char folder[SPOOL_PATH_MAX], path[SPOOL_PATH_MAX];
	struct disk_list l;
	spool_job_path(s, id, NULL, folder);
	disk_list_begin(&l, folder);
	for (const char *name; (name = disk_list_next(&l));) {
		spool_job_path(s, id, name, path);
		disk_unlink(path);
	}
	int rc = disk_list_end(&l, 0, e);
	if (!rc && disk_rmdir(folder))
		rc = error_file(e, errno, folder);
	return rc == -ENOENT ? 0 : rc;
}
