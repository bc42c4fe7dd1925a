/* SPDX-License-Identifier: Apache-2.0 */
/* The rows and notes of one of the ledger's two files (ledger.h), accessed by prepared statements. One thread. */
#ifndef COORDINATOR_STORE_LEDGER_REPLICA_H
#define COORDINATOR_STORE_LEDGER_REPLICA_H

#include "common/base/error.h"
#include "coordinator/store/ledger_job.h"

#include <sqlite3.h>

enum ledger_statement {
	LEDGER_PUT,
	LEDGER_REMOVE,
	LEDGER_GET,
	LEDGER_GET_NEXT,
	LEDGER_SET_NOTE,
	LEDGER_GET_NOTE,
	LEDGER_STATEMENT_COUNT
};

struct ledger_replica {
	sqlite3 *db;
	sqlite3_stmt *statements[LEDGER_STATEMENT_COUNT];
};

/* schema: the name of the file in db. Must be closed even after an error. */
int ledger_replica_open(struct ledger_replica *s, sqlite3 *db, const char *schema, struct error *e);
void ledger_replica_close(struct ledger_replica *s);

/* ledger_replica_get reads the row of this id, ledger_replica_get_next the first row above it. Both return 1 if found,
 * 0 if not. Texts and bytes are valid until the next call of the same function, or until ledger_replica_release, which
 * ends the read transaction: while there is one, SQLite does not copy the WAL into the database. */
int ledger_replica_get(struct ledger_replica *s, uint64_t id, struct ledger_job *j, struct error *e);
int ledger_replica_get_next(struct ledger_replica *s, uint64_t id, struct ledger_job *j, struct error *e);
void ledger_replica_release(struct ledger_replica *s);

/* Writes a row in two steps. ledger_replica_bind copies the row, so it may be a row that was read and is released
 * before ledger_replica_put. Returns -ENOMEM if out of memory. */
int ledger_replica_bind(struct ledger_replica *side, const struct ledger_job *j, struct error *e);
int ledger_replica_put(struct ledger_replica *s, struct error *e);
int ledger_replica_remove(struct ledger_replica *s, uint64_t id, struct error *e);
int ledger_replica_set_note(struct ledger_replica *s, const char *name, const char *text, struct error *e);
/* Reads a note; *text is mem_alloc'd. Returns -ENOENT if there is none, -EBADMSG if its checksum does not match. */
int ledger_replica_get_note(struct ledger_replica *side, const char *name, char **text, struct error *e);

#endif
