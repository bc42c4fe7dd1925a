/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The coordinator's folder: lock, next-job, blobs/, canvas/, jobs.db, jobs/jN/{job.json, journal.G, checkpoint, order,
 * result.exr, preview.exr, log}. Names are flushed with their folders (common/base/disk.h). One coordinator per spool
 * (a lock that the kernel drops when its holder dies). Files are written atomically: temporary file, fsync, rename,
 * fsync of the folder. spool_write from any thread (for different files); everything else from one.
 */
#ifndef COORDINATOR_STORE_SPOOL_H
#define COORDINATOR_STORE_SPOOL_H

#include "coordinator/store/record.h"

struct spool;

/* Creates the folder if necessary. -EBUSY: another coordinator uses it. */
int spool_open(struct spool **s, const char *folder, struct error *e);
void spool_close(struct spool *s);

/* Ids from here on were never used. From the counter or the folders' names, whichever is higher. */
uint64_t spool_next_job(const struct spool *s);
/* Ids up to this one were used, whatever the counter says. */
void spool_skip_jobs(struct spool *s, uint64_t id);
/* Uses the id: creates the job's folder and advances the counter, durably. */
int spool_take_job(struct spool *s, uint64_t id, struct error *e);

/* "blobs", "canvas": a path in the spool, created if necessary. The text is valid until spool_close. */
const char *spool_blobs(const struct spool *s);
const char *spool_canvas(const struct spool *s);
enum { SPOOL_PATH_MAX = 4096 };
void spool_path(const struct spool *s, const char *name,
		char path[SPOOL_PATH_MAX]); /* path of name in the spool's own folder */
void spool_job_path(const struct spool *s, uint64_t id, const char *file, char path[SPOOL_PATH_MAX]);

int spool_write(const struct spool *s, uint64_t id, const char *file, const void *bytes, size_t size, struct error *e);
/* Files in the spool's own folder. Reading: mem_alloc'd; -ENOENT. */
int spool_write_own(const struct spool *s, const char *file, const void *bytes, size_t size, struct error *e);
int spool_read_own(const struct spool *s, const char *file, char **text, size_t *size, struct error *e);
/* Renames path to that name, in this folder, durably. Any thread. */
int spool_rename(const char *from, const char *to, const char *folder, struct error *e);
int spool_write_record(const struct spool *s, const struct job_record *r, struct error *e);
/* -ENOENT: no such job. */
int spool_read_record(const struct spool *s, uint64_t id, struct job_record *r, struct error *e);
/* The start of a file, in all versions: a name and three digits, its version. -EBADMSG: another name; -EPROTO, with
 * a sentence: another version. Any thread. */
int spool_check_version(const char got[8], const char known[8], const char *path, struct error *e);
/* All ids that have a folder, ascending; mem_alloc'd, NULL: none. */
int spool_jobs(const struct spool *s, uint64_t **ids, size_t *count, struct error *e);
/* Deletes the job's folder with its contents, the record last. */
void spool_drop_job(const struct spool *s, uint64_t id);

#endif
