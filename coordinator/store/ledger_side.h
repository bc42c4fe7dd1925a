/* SPDX-License-Identifier: Apache-2.0 */
/* The rows and notes of one of the ledger's two files (ledger.h), accessed by prepared statements. One thread. */
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

/* schema: the name of the file in db. Must be closed even after an error. */
int ledger_side_open(struct ledger_side *s, sqlite3 *db, const char *schema, struct error *e);
void ledger_side_close(struct ledger_side *s);

/* ledger_side_get reads the row of this id, ledger_side_after the first row above it. Both return 1 if found, 0 if
 * not. Texts and bytes are valid until the next call of the same function, or until ledger_side_release, which ends
 * the read transaction: while there is one, SQLite does not copy the WAL into the database. */
int ledger_side_get(struct ledger_side *s, uint64_t id, struct ledger_job *j, struct error *e);
int ledger_side_after(struct ledger_side *s, uint64_t id, struct ledger_job *j, struct error *e);
void ledger_side_release(struct ledger_side *s);

/* Writes a row in two steps. ledger_side_bind copies the row, so it may be a row that was read and is released before
 * ledger_side_put. Returns -ENOMEM if out of memory. */
int ledger_side_bind(struct ledger_side *s, const struct ledger_job *j, struct error *e);
int ledger_side_put(struct ledger_side *s, struct error *e);
int ledger_side_remove(struct ledger_side *s, uint64_t id, struct error *e);
int ledger_side_set(struct ledger_side *s, const char *name, const char *text, struct error *e);
/* Reads a note; *text is mem_alloc'd. Returns -ENOENT if there is none, -EBADMSG if its checksum does not match. */
int ledger_side_note(struct ledger_side *s, const char *name, char **text, struct error *e);

#endif
