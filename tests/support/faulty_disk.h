/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A simulated disk behind common/base/disk.h and SQLite. Below one folder it carries out all calls, and keeps in memory
 * what would remain after a loss of power. A file's bytes and length are safe after a flush of the file, its name after
 * a flush of the folder. Of later changes, a loss of power keeps a random part: bytes by sector, lengths, and names one
 * by one (created, renamed, removed). As on real systems, a failed flush of a file forgets the unwritten bytes, and the
 * next flush reports success. What remains is written to another folder, and the process ends. Alternatively, calls
 * fail from the n-th on.
 *
 * Must be used in a process of its own (fork): faulty_disk_begin replaces the disk functions and SQLite's default VFS
 * for good. Any thread; nothing is really flushed. Films mapped into memory (O_TMPFILE) are ignored, because they do
 * not survive anyway.
 */
#ifndef TESTS_SUPPORT_FAULTY_DISK_H
#define TESTS_SUPPORT_FAULTY_DISK_H

#include "common/base/disk.h"

#include <sqlite3.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { FAULTY_DISK_EXIT_CODE = 42, FAULTY_DISK_COUNTS = 5 };

/* Flushes to be skipped on purpose, to see whether a test notices: these calls do nothing and report success. */
enum faulty_disk_forget {
	FAULTY_DISK_FORGET_NOTHING,
	FAULTY_DISK_FORGET_FILES = 1,
	FAULTY_DISK_FORGET_FOLDERS = 2,
	FAULTY_DISK_FORGET_DATABASE = 4
};

struct faulty_disk_options {
	const char *root;    /* absolute path of an existing folder */
	const char *remains; /* folder for what remains; must not exist yet */
	uint64_t seed;
	uint64_t power_loss_at;	     /* power is lost before this modifying call, counted from 1; 0: never */
	uint64_t first_failing_call; /* calls fail from this one on, counting all calls; 0: none fails */
	uint64_t failing_call_count;
	int failure_errno;
	uint64_t power_loss_after; /* power is lost this many modifying calls after the first failed call; 0: not */
	bool fail_writes_only;	   /* as on a disk that is full or read-only: reading and removing still work */
	enum faulty_disk_forget forget;
	const char *forget_name; /* only for files or folders whose last path component is this; NULL: for all */
	/* Shared with the parent process; may be NULL. [0]: modifying calls; [1]: all calls; [2]: failed calls; [3]:
	 * lost sectors and names; [4]: if not 0, power is lost before the next modifying call. */
	_Atomic uint64_t *counts;
};

void faulty_disk_begin(const struct faulty_disk_options *options);
void faulty_disk_power_off(void); /* loses power now */

/* ---- for faulty_disk_vfs.c and faulty_disk_calls.c */

struct faulty_disk_node;
struct faulty_disk_node *faulty_disk_find_node(const char *path, bool create); /* NULL: not below the root */
/* Called before a disk call: returns 0, or the errno with which the call is to fail. Locks; faulty_disk_end_call
 * unlocks. */
enum faulty_disk_call { FAULTY_DISK_READ, FAULTY_DISK_OPEN, FAULTY_DISK_WRITE, FAULTY_DISK_FLUSH, FAULTY_DISK_REMOVE };
int faulty_disk_begin_call(enum faulty_disk_call kind);
void faulty_disk_end_call(void);
void faulty_disk_record_write(struct faulty_disk_node *n, const void *bytes, size_t size, uint64_t offset);
void faulty_disk_record_truncate(struct faulty_disk_node *n, uint64_t size);
void faulty_disk_record_flush(struct faulty_disk_node *n, bool database);
void faulty_disk_record_failed_flush(struct faulty_disk_node *n);
void faulty_disk_record_folder_flush(const char *path);
void faulty_disk_record_removal(const char *path);
void faulty_disk_record_rename(const char *from, const char *to);
void faulty_disk_record_new_folder(const char *path);
void faulty_disk_register_vfs(void);
extern const struct disk faulty_disk_calls;

#endif
