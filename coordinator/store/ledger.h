/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The coordinator's database, in SQLite (the only user of SQLite): a row for each job, with its submission and its
 * record, and named notes. Two files in the spool, jobs.db and jobs-copy.db, have the same contents: what is lost or
 * damaged in one of them is restored from the other when they are opened. They use WAL and synchronous FULL:
 * everything written is durable in jobs.db when a call returns. jobs-copy.db follows; if it cannot be written, that
 * is logged, and ledger_repair_copy tries again.
 *
 * Each job's row has a checksum, because SQLite has none; changing a damaged row fails with -EBADMSG. A job that has
 * ended keeps its row until it is dropped. One thread. The version of the schema is the database's user_version;
 * earlier versions are upgraded when the database is opened, later ones are refused.
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

/* Opens the database in `folder`, the spool. A file that is not a database, or is damaged, is renamed to *.damaged
 * and restored from the other one. Returns -EPROTO if a later version wrote it. */
int ledger_open(struct ledger **out, const char *folder, struct error *e);
void ledger_close(struct ledger *l); /* l may be NULL */
/* Whether the database had no job when it was opened and never had one: the spool is new, or has lost both files. */
bool ledger_is_new(const struct ledger *l);
/* Brings jobs-copy.db up to date if it could not be written. Call now and then. */
int ledger_repair_copy(struct ledger *l, struct error *e);

/* Returns the next free id: no job had this id or a higher one, including jobs whose rows were dropped. */
uint64_t ledger_next_id(const struct ledger *l);
/* Ids up to this one will not be given to new jobs. */
int ledger_skip_ids(struct ledger *l, uint64_t id, struct error *e);
/* Adds the row of a new, live job. Returns -EEXIST if the id is taken. */
int ledger_add(struct ledger *l, const struct ledger_job *j, struct error *e);
/* Writes a row as it is, including its revision, in place of an existing one. */
int ledger_write_row(struct ledger *l, const struct ledger_job *j, struct error *e);
int ledger_delete(struct ledger *l, uint64_t id, struct error *e); /* deletes a row, whether its job has ended or not */
/* Deletes the rows of ended jobs, all at once. Sets the ids of live jobs in the list to 0 and keeps their rows. */
int ledger_delete_ended(struct ledger *l, uint64_t *ids, size_t count, struct error *e);
/* holder: the user who holds the job; "": released. */
int ledger_set_holder(struct ledger *l, uint64_t id, const char *holder, struct error *e);
int ledger_set_priority(struct ledger *l, uint64_t id, int priority, struct error *e);
/* Records that the job has ended, with record r; ignored if the job has been extended since (r->extended differs).
 * extendable: the row keeps its submission and plan. */
int ledger_end_job(struct ledger *l, const struct job_record *r, bool extendable, struct error *e);
/* Sets another submission, plan and number of extensions; a job that has ended becomes live again. Returns -ENOENT if
 * there is no such job. */
int ledger_extend_job(struct ledger *l, const struct ledger_job *extension, struct error *e);
/* Deletes the submission and plan in the row of an ended job. */
int ledger_delete_submission(struct ledger *l, uint64_t id, struct error *e);

enum ledger_selection { LEDGER_ALL, LEDGER_LIVE };
/* Returns the ids, ascending; *ids is mem_alloc'd, NULL if there are none. Reads the whole table, which takes long if
 * it is large. */
int ledger_list_ids(struct ledger *l, enum ledger_selection selection, uint64_t **ids, size_t *count, struct error *e);
enum ledger_range { LEDGER_ABOVE, LEDGER_BELOW, LEDGER_LATEST };
/* Returns the ids of at most `max_count` ended jobs: those nearest above `id`, ascending; nearest below `id`,
 * descending; or, with LEDGER_LATEST, those below `id` that ended last, the latest first, which reads the whole table.
 */
int ledger_list_ended(struct ledger *l, enum ledger_range range, uint64_t id, uint64_t *ids, size_t max_count,
		      size_t *count, struct error *e);
/* Counted once, then kept up to date; 0 also if the table cannot be read. */
uint64_t ledger_ended_count(struct ledger *l);
/* Reads a row. Its texts and bytes are valid until the next call. Returns 1, 0 if there is none, or an error. */
int ledger_read_row(struct ledger *l, uint64_t id, struct ledger_job *j, struct error *e);

int ledger_write_record(struct ledger *l, const struct job_record *r, struct error *e); /* -ENOENT: no such job */
/* Reads a job's record. Returns -ENOENT if there is no such job, or it has no record; -EBADMSG if it is damaged;
 * -EPROTO if it is of another version. */
int ledger_read_record(struct ledger *l, uint64_t id, struct job_record *r, struct error *e);
/* Like ledger_read_record(), but also returns the time of the end in the row (ledger_job.h). */
int ledger_read_end(struct ledger *l, uint64_t id, struct job_record *r, double *ended, struct error *e);

/* Writes a note. */
int ledger_set_note(struct ledger *l, const char *name, const char *text, struct error *e);
/* Returns a note; *text is mem_alloc'd. -ENOENT: there is none. */
int ledger_get_note(struct ledger *l, const char *name, char **text, struct error *e);

#endif
