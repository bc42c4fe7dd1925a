/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What the coordinator knows, in SQLite (the only user of SQLite): a row for each job, with its submission and its
 * record, and named notes. Two files in the spool, jobs.db and jobs-copy.db, have the same contents: what one of them
 * has lost or damaged is restored from the other when they are opened. WAL, synchronous FULL: everything written is
 * durable in jobs.db when a call returns. jobs-copy.db follows; if it cannot be written, that is logged, and
 * ledger_mend tries again.
 *
 * Each job's row has a checksum, because SQLite has none; changing a damaged row fails with -EBADMSG. A job that has
 * ended keeps its row until it is dropped. One thread. The scheme's version is the database's user_version; the one
 * before is upgraded when the database is opened, others are refused.
 */
#ifndef COORDINATOR_STORE_LEDGER_H
#define COORDINATOR_STORE_LEDGER_H

#include "common/base/error.h"
#include "coordinator/store/ledger_job.h"
#include "coordinator/store/record.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct ledger;

/* folder: the spool. A file that is not a database is renamed to *.damaged and restored from the other. -EPROTO: of
 * another version. */
int ledger_open(struct ledger **l, const char *folder, struct error *e);
void ledger_close(struct ledger *l); /* l may be NULL */
/* No job was in it when it was opened, and none ever had been: of a new spool, or of one that has lost both files. */
bool ledger_is_new(const struct ledger *l);
/* Brings jobs-copy.db up to date, if it could not be written. Call now and then. */
int ledger_mend(struct ledger *l, struct error *e);

/* ---- jobs */

/* No job had an id from here on, not even one whose row was dropped. */
uint64_t ledger_next_id(const struct ledger *l);
int ledger_skip_ids(struct ledger *l, uint64_t id, struct error *e); /* ids up to this one are not given */
/* A new job, live. -EEXIST: the id is taken. */
int ledger_add(struct ledger *l, const struct ledger_job *j, struct error *e);
/* Writes a row, including its revision, in place of any that exists. */
int ledger_put(struct ledger *l, const struct ledger_job *j, struct error *e);
int ledger_forget(struct ledger *l, uint64_t id, struct error *e); /* deletes it, whatever it is */
/* Deletes these rows at once, except those of live jobs, whose ids become 0. */
int ledger_drop(struct ledger *l, uint64_t *ids, size_t count, struct error *e);
int ledger_hold(struct ledger *l, uint64_t id, const char *who, struct error *e); /* "": release */
int ledger_priority(struct ledger *l, uint64_t id, int priority, struct error *e);
/* The job has ended, after r->extended extensions, with this record; ignored for one that was extended since.
 * extendable: the row keeps its submission and plan. */
int ledger_end(struct ledger *l, const struct job_record *r, bool extendable, struct error *e);
/* Sets another submission, plan and number of extensions; a job that has ended runs again. -ENOENT */
int ledger_extend(struct ledger *l, const struct ledger_job *j, struct error *e);
/* The row of an ended job forgets its submission and plan. */
int ledger_drop_submission(struct ledger *l, uint64_t id, struct error *e);

enum ledger_which { LEDGER_ALL, LEDGER_LIVE };
/* Their ids, ascending; mem_alloc'd, NULL: none. It reads the whole table, which takes long where it is large. */
int ledger_ids(struct ledger *l, enum ledger_which which, uint64_t **ids, size_t *count, struct error *e);
enum ledger_from { LEDGER_ABOVE, LEDGER_BELOW, LEDGER_LAST };
/* The ids of ended jobs that are nearest above that id, ascending, or below it, descending: at most `most`.
 * LEDGER_LAST: those below it that ended last, the latest first; it reads the whole table. */
int ledger_ended(struct ledger *l, enum ledger_from from, uint64_t id, uint64_t *ids, size_t most, size_t *count,
		 struct error *e);
uint64_t ledger_ended_count(struct ledger *l); /* read once, then counted; 0 also if it cannot be read */
/* Texts and bytes are valid until the next call. 1; 0: not found. */
int ledger_get(struct ledger *l, uint64_t id, struct ledger_job *j, struct error *e);

int ledger_write_record(struct ledger *l, const struct job_record *r, struct error *e); /* -ENOENT */
/* -ENOENT: no such job, or it has no record; -EBADMSG: damaged; -EPROTO: of another version. */
int ledger_read_record(struct ledger *l, uint64_t id, struct job_record *r, struct error *e);
/* The same, with the row's time of the end (ledger_job.h). */
int ledger_read_end(struct ledger *l, uint64_t id, struct job_record *r, double *ended, struct error *e);

/* ---- notes */

int ledger_set(struct ledger *l, const char *name, const char *text, struct error *e);
/* mem_alloc'd. -ENOENT */
int ledger_note(struct ledger *l, const char *name, char **text, struct error *e);

#endif
