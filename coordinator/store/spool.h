/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The coordinator's folder: lock, reserve, jobs.db and jobs-copy.db (ledger.h), blobs/, canvas/, jobs/jN/{journal.G,
 * checkpoint, result.exr, preview.exr, log}. Names are flushed with their folders (common/base/disk.h). One coordinator
 * per spool (a lock that the kernel drops when its holder dies). Files are written atomically: temporary file, fsync,
 * rename, fsync of the folder. spool_write from any thread (for different files); everything else from one.
 */
#ifndef COORDINATOR_STORE_SPOOL_H
#define COORDINATOR_STORE_SPOOL_H

#include "common/base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct spool;

/* Creates the folder if necessary. -EBUSY: another coordinator uses it. */
int spool_open(struct spool **s, const char *folder, struct error *e);
void spool_close(struct spool *s);

/* A file that holds room on the disk: SPOOL_RESERVE bytes, made by spool_reserve while four times as many are free. A
 * job that is cancelled because the disk is full needs some of them to be recorded. false: there is none. */
enum { SPOOL_RESERVE = 1 << 18 };
void spool_reserve(const struct spool *s);
bool spool_use_reserve(const struct spool *s);

/* -ENOSPC: the spool's file system is smaller, however much of it is free. */
int spool_holds(const struct spool *s, uint64_t bytes, struct error *e);
int spool_make_job(const struct spool *s, uint64_t id, struct error *e); /* creates the job's folder */

/* "blobs", "canvas": a path in the spool, created if necessary. The text is valid until spool_close. */
const char *spool_blobs(const struct spool *s);
const char *spool_canvas(const struct spool *s);
enum { SPOOL_PATH_MAX = 4096 };
void spool_path(const struct spool *s, const char *name,
		char path[SPOOL_PATH_MAX]); /* path of name in the spool's own folder */
void spool_job_path(const struct spool *s, uint64_t id, const char *file, char path[SPOOL_PATH_MAX]);

int spool_write(const struct spool *s, uint64_t id, const char *file, const void *bytes, size_t size, struct error *e);
/* The start of a file, in all versions: a name and three digits, its version. -EBADMSG: another name; -EPROTO, with
 * a sentence: another version. Any thread. */
int spool_check_version(const char got[8], const char known[8], const char *path, struct error *e);
/* All ids that have a folder, ascending; mem_alloc'd, NULL: none. */
int spool_jobs(const struct spool *s, uint64_t **ids, size_t *count, struct error *e);
/* Bytes of a job's merged results: its journals, and `checkpoints` times its checkpoint; 0 without a folder. After an
 * error those of the files that could be looked at. Any thread. */
int spool_film_bytes(const struct spool *s, uint64_t id, unsigned checkpoints, uint64_t *bytes, struct error *e);
/* Deletes the job's folder with its contents; it may be gone already. -errno: some of it is left. */
int spool_drop_job(const struct spool *s, uint64_t id, struct error *e);

#endif
