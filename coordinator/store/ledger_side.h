/* SPDX-License-Identifier: Apache-2.0 */
/* The rows and notes of one of the ledger's two files (ledger.h), by prepared statements. One thread. */
#ifndef COORDINATOR_STORE_LEDGER_SIDE_H
#define COORDINATOR_STORE_LEDGER_SIDE_H

#include "common/base/error.h"
#include "coordinator/store/ledger_job.h"

#include <sqlite3.h>

enum ledger_statement {
	LEDGER_PUT,
	LEDGER_REMOVE,
	LEDGER_GET,
	LEDGER_AFTER,
	LEDGER_SET,
	LEDGER_NOTE,
	LEDGER_STATEMENTS
};

struct ledger_side {
	sqlite3 *db;
	sqlite3_stmt *statements[LEDGER_STATEMENTS];
};

/* schema: the file's in db. To be closed also after an error. */
int ledger_side_open(struct ledger_side *s, sqlite3 *db, const char *schema, struct error *e);
void ledger_side_close(struct ledger_side *s);

/* The row of that id, or the first one above it. 1: found; 0: not. Its texts and bytes are valid until the next call
 * of the same, or until ledger_side_release, which ends the read transaction: as long as there is one, SQLite does not
 * copy the WAL into the database. */
int ledger_side_get(struct ledger_side *s, uint64_t id, struct ledger_job *j, struct error *e);
int ledger_side_after(struct ledger_side *s, uint64_t id, struct ledger_job *j, struct error *e);
void ledger_side_release(struct ledger_side *s);

/* Writes a row in two steps: the first copies it, so that it may be one that was read and is released in between.
 * -ENOMEM */
int ledger_side_bind(struct ledger_side *s, const struct ledger_job *j, struct error *e);
int ledger_side_put(struct ledger_side *s, struct error *e);
int ledger_side_remove(struct ledger_side *s, uint64_t id, struct error *e);
int ledger_side_set(struct ledger_side *s, const char *name, const char *text, struct error *e);
/* mem_alloc'd; -ENOENT, -EBADMSG: its checksum does not hold. */
int ledger_side_note(struct ledger_side *s, const char *name, char **text, struct error *e);

#endif
