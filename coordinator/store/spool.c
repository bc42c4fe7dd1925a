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
	char *folder, *blob_folder, *canvas_folder;
	int lock_fd;
};

static char *join_path(const char *folder, const char *name)
{
	size_t size = strlen(folder) + strlen(name) + 2;
	char *path = mem_alloc(size, 1);
	if (path)
		snprintf(path, size, "%s/%s", folder, name);
	return path;
}

static int acquire_lock(struct spool *s, struct error *e)
{
	char *path = join_path(s->folder, "lock");
	if (!path)
		return error_set(e, ENOMEM, "no memory for the spool");
	s->lock_fd = disk_open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
	int rc = 0;
	if (s->lock_fd < 0)
		rc = error_file(e, errno, path);
	else if (disk_flock(s->lock_fd, LOCK_EX | LOCK_NB))
		rc = errno == EWOULDBLOCK ? error_set(e, EBUSY, "%s: another coordinator uses this spool", s->folder)
					  : error_file(e, errno, path);
	mem_free(path);
	return rc;
}

static bool parse_job_folder_name(const char *name, uint64_t *id)
{
	char canonical[32];
	char *end;
	if (name[0] != 'j')
		return false;
	*id = strtoull(name + 1, &end, 10);
	snprintf(canonical, sizeof canonical, "j%llu", (unsigned long long)*id);
	return *id && strcmp(canonical, name) == 0;
}

static int compare_ids(const void *a, const void *b)
{
	uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
	return (x > y) - (x < y);
}

int spool_list_jobs(const struct spool *s, uint64_t **ids, size_t *count, struct error *e)
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
		if (!parse_job_folder_name(name, &id))
			continue;
		uint64_t *grown = list_grow_array(*ids, *count, sizeof *grown);
		if (grown)
			(*ids = grown)[(*count)++] = id;
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
		qsort(*ids, *count, sizeof **ids, compare_ids);
	return rc;
}

int spool_open(struct spool **out, const char *folder, struct error *e)
{
	if (strlen(folder) > FOLDER_MAX)
		return error_set(e, ENAMETOOLONG, "%s: the name is too long", folder);
	struct spool *s = mem_alloc(1, sizeof *s);
	if (!s)
		return error_set(e, ENOMEM, "no memory for the spool");
	s->lock_fd = -1;
	s->folder = mem_strdup(folder);
	s->blob_folder = join_path(folder, "blobs");
	s->canvas_folder = join_path(folder, "canvas");
	char *jobs = join_path(folder, "jobs");
	int rc = !s->folder || !s->blob_folder || !s->canvas_folder || !jobs
			 ? error_set(e, ENOMEM, "no memory for the spool")
			 : disk_make_folder(folder, e);
	if (!rc)
		rc = acquire_lock(s, e);
	if (!rc)
		rc = disk_make_folder(jobs, e);
	if (!rc)
		rc = disk_make_folder(s->canvas_folder, e);
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
	if (s->lock_fd >= 0)
		disk_close(s->lock_fd);
	mem_free(s->folder);
	mem_free(s->blob_folder);
	mem_free(s->canvas_folder);
	mem_free(s);
}

void spool_create_reserve(const struct spool *s)
{
	char path[SPOOL_PATH_MAX];
	struct stat st;
	spool_path(s, "reserve", path);
	if (disk_stat(path, &st) == 0 ? st.st_size == SPOOL_RESERVE_BYTES
				      : disk_available(s->folder) < 4 * SPOOL_RESERVE_BYTES)
		return;
	int fd = disk_open(path, O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
	if (fd < 0)
		return;
	bool allocated = disk_posix_fallocate(fd, 0, SPOOL_RESERVE_BYTES) == 0;
	disk_close(fd);
	if (!allocated)
		disk_unlink(path);
}

bool spool_release_reserve(const struct spool *s)
{
	char path[SPOOL_PATH_MAX];
	spool_path(s, "reserve", path);
	return disk_unlink(path) == 0;
}

int spool_create_job_folder(const struct spool *s, uint64_t id, struct error *e)
{
	char path[SPOOL_PATH_MAX];
	spool_job_path(s, id, NULL, path);
	return disk_make_folder(path, e);
}

int spool_check_capacity(const struct spool *s, uint64_t bytes, struct error *e)
{
	uint64_t capacity = disk_capacity(s->folder);
	if (!capacity || bytes <= capacity)
		return 0;
	return error_set(e, ENOSPC,
			 "it may need %.3g MB for its files and films, and the disk of the coordinator's spool has "
			 "%.3g MB in all: a smaller --size or --crop, or less --groups",
			 1e-6 * (double)bytes, 1e-6 * (double)capacity);
}

const char *spool_blob_folder(const struct spool *s)
{
	return s->blob_folder;
}

const char *spool_canvas_folder(const struct spool *s)
{
	return s->canvas_folder;
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

int spool_write_job_file(const struct spool *s, uint64_t id, const char *file, const void *bytes, size_t size,
			 struct error *e)
{
	char path[SPOOL_PATH_MAX];
	spool_job_path(s, id, file, path);
	int rc = disk_replace(path, bytes, size, 0600, e);
	if (rc)
		return rc;
	spool_job_path(s, id, NULL, path);
	return disk_sync_folder(path, e);
}

int spool_check_version(const char actual[8], const char expected[8], const char *path, struct error *e)
{
	enum { NAME_SIZE = 5, VERSION_DIGITS = 3 };
	bool same = memcmp(actual, expected, NAME_SIZE) == 0;
	for (int i = NAME_SIZE; i < NAME_SIZE + VERSION_DIGITS; i++)
		same = same && actual[i] >= '0' && actual[i] <= '9';
	if (!same)
		return error_set(e, EBADMSG, "%s: damaged", path);
	if (memcmp(actual + NAME_SIZE, expected + NAME_SIZE, VERSION_DIGITS) == 0)
		return 0;
	return error_set(e, EPROTO,
			 "%s has version %.3s, and this coordinator reads version %.3s: another release wrote it", path,
			 actual + NAME_SIZE, expected + NAME_SIZE);
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

int spool_delete_job(const struct spool *s, uint64_t id, struct error *e)
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
