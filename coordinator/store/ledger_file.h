/* SPDX-License-Identifier: Apache-2.0 */
/* One file of the ledger (ledger.h), before it is used. One thread. */
#ifndef COORDINATOR_STORE_LEDGER_FILE_H
#define COORDINATOR_STORE_LEDGER_FILE_H

#include "common/base/error.h"

#include <sqlite3.h>

/* Creates the file if necessary, upgrades it and checks it. -EBADMSG: not a database, or damaged; -EPROTO: of another
 * version; -ENOSPC, -ENOMEM, -EIO. */
int ledger_file_prepare(const char *path, struct error *e);
/* Renames it to PATH.damaged, with its WAL. */
int ledger_file_keep_damaged(const char *path, struct error *e);
/* Opens it; *db is to be closed also after an error. */
int ledger_file_open(const char *path, sqlite3 **db, struct error *e);
int ledger_file_attach(sqlite3 *db, const char *path, const char *schema, struct error *e);
int ledger_file_run(sqlite3 *db, const char *sql, struct error *e);
/* The error of the last call of SQLite. */
int ledger_file_error(sqlite3 *db, struct error *e);

#endif
