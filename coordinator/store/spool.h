/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The coordinator's folder: lock, reserve, jobs.db and jobs-copy.db (ledger.h), blobs/, canvas/, jobs/jN/{journal.G,
 * checkpoint, result.exr, preview.exr, log}. Names are flushed with their folders (common/base/disk.h). Only one
 * coordinator can use a spool (the kernel drops the lock when its holder dies). Files are written atomically:
 * temporary file, fsync, rename, fsync of the folder. spool_write_job_file may be called from any thread (for different
 * files); everything else from one.
 */
#ifndef COORDINATOR_STORE_SPOOL_H
#define COORDINATOR_STORE_SPOOL_H

#include "common/base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct spool;

/* Creates the folder if necessary. Returns -EBUSY if another coordinator uses it. */
int spool_open(struct spool **out, const char *folder, struct error *e);
void spool_close(struct spool *s);

/* A file of SPOOL_RESERVE_BYTES bytes that occupies disk space. spool_create_reserve creates it while four times as
 * many bytes are free. spool_release_reserve deletes it, because a job that is cancelled when the disk is full needs
 * some space to be recorded; it returns false if there is no reserve. */
enum { SPOOL_RESERVE_BYTES = 1 << 18 };
void spool_create_reserve(const struct spool *s);
bool spool_release_reserve(const struct spool *s);

/* Returns -ENOSPC if the spool's file system is smaller than `bytes`, no matter how much of it is free. */
int spool_check_capacity(const struct spool *s, uint64_t bytes, struct error *e);
int spool_create_job_folder(const struct spool *s, uint64_t id, struct error *e); /* creates the job's folder */

/* The folders "blobs" and "canvas" of the spool. The text is valid until spool_close. */
const char *spool_blob_folder(const struct spool *s);
const char *spool_canvas_folder(const struct spool *s);
enum { SPOOL_PATH_MAX = 4096 };
/* Writes the path of a file in the spool's own folder. */
void spool_path(const struct spool *s, const char *name, char path[SPOOL_PATH_MAX]);
/* Writes the path of a file in a job's folder; file NULL: of the folder. */
void spool_job_path(const struct spool *s, uint64_t id, const char *file, char path[SPOOL_PATH_MAX]);

/* Writes a file of the job atomically and durably. */
int spool_write_job_file(const struct spool *s, uint64_t id, const char *file, const void *bytes, size_t size,
			 struct error *e);
/* Checks the first bytes of a file, which in all versions are a name of five bytes and a version of three digits.
 * Returns -EBADMSG if the name differs, -EPROTO with a sentence if the version does. Any thread. */
int spool_check_version(const char actual[8], const char expected[8], const char *path, struct error *e);
/* Returns the ids of all jobs that have a folder, ascending; *ids is mem_alloc'd, NULL if there are none. */
int spool_list_jobs(const struct spool *s, uint64_t **ids, size_t *count, struct error *e);
/* Returns in *bytes the size of a job's merged results: its journals, plus `checkpoints` times its checkpoint; 0
 * without a folder. After an error it is the size of the files that could be examined. Any thread. */
int spool_film_bytes(const struct spool *s, uint64_t id, unsigned checkpoints, uint64_t *bytes, struct error *e);
/* Deletes the job's folder with its contents; it may be gone already. Returns -errno if some of it is left. */
int spool_delete_job(const struct spool *s, uint64_t id, struct error *e);

#endif
