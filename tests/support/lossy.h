/*
 * A disk of tests behind common/base/disk.h and behind SQLite: below one folder it does what is asked of it and keeps beside, in
 * memory, what a loss of power would leave. A file's bytes and length are safe after a flush of the file, its name after a flush of
 * the folder; of what was done since, a loss of power keeps a random part: of bytes by the sector, of lengths, of names one by one
 * (made, renamed, gone). A flush of a file that fails forgets what it did not write, and the next one says that all is well, as
 * systems do. What is left is written to another folder, and the process ends. Or calls fail, from the n-th on.
 *
 * For a process of its own (fork): lossy_begin replaces the door and SQLite's default VFS for good. Any thread; nothing is
 * flushed for real. Films mapped into memory (O_TMPFILE) are not looked at: nobody finds them again.
 */
#ifndef TESTS_SUPPORT_LOSSY_H
#define TESTS_SUPPORT_LOSSY_H

#include <sqlite3.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { LOSSY_EXIT = 42, LOSSY_COUNTS = 5 };

/* What is to be forgotten on purpose, to see whether a test notices: calls that do nothing and say that all is well. */
enum lossy_forget { LOSSY_FORGET_NOTHING, LOSSY_FORGET_FILES = 1, LOSSY_FORGET_FOLDERS = 2, LOSSY_FORGET_DATABASE = 4 };

struct lossy {
	const char *root;  /* absolute, there */
	const char *after; /* what is left is put there; not there yet */
	uint64_t seed;
	uint64_t lose_at;      /* the power goes before this call that changes something, counted from 1; 0: never */
	uint64_t fail_from;    /* calls fail, from this one of all on; 0: none */
	uint64_t fail_count;   /* so many */
	int fail_with;         /* errno */
	uint64_t lose_after;   /* the power goes so many calls that change something after the first that failed; 0: not */
	bool fail_writes_only; /* as on a disk that is full, or read-only: reading and making room go on */
	enum lossy_forget forget;
	const char *forget_name; /* only of files or folders with this last part of their name; NULL: all */
	/* Shared with the parent; NULL: nobody asks. [0]: calls that change something; [1]: all; [2]: those that failed; [3]: sectors and
	 * names that were lost; [4]: not 0: the power goes before the next call that changes something. */
	_Atomic uint64_t *counts;
};

void lossy_begin(const struct lossy *l);
void lossy_power_off(void); /* now */

/* ---- for lossy_vfs.c */

struct lossy_node;
struct lossy_node *lossy_node_of(const char *path, bool create); /* NULL: not below the root */
/* Before a call: 0, or the errno that it fails with. Locks; lossy_leave unlocks. */
enum lossy_call { LOSSY_READS, LOSSY_OPENS, LOSSY_WRITES, LOSSY_FLUSHES, LOSSY_REMOVES };
int lossy_enter(enum lossy_call what);
void lossy_leave(void);
void lossy_wrote(struct lossy_node *n, const void *bytes, size_t size, uint64_t at);
void lossy_cut(struct lossy_node *n, uint64_t size);
void lossy_flushed(struct lossy_node *n, bool database);
void lossy_failed(struct lossy_node *n);
void lossy_flushed_folder_of(const char *path);
void lossy_removed(const char *path);
void lossy_vfs_begin(void);

#endif
