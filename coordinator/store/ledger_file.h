/* SPDX-License-Identifier: Apache-2.0 */
/* One of the two files of the ledger (ledger.h): opening, upgrading, checking. One thread. */
#ifndef COORDINATOR_STORE_LEDGER_FILE_H
#define COORDINATOR_STORE_LEDGER_FILE_H

#include "common/base/error.h"

#include <sqlite3.h>

/* Creates the file if necessary, upgrades it and checks it. Returns -EBADMSG if it is not a database or is damaged;
 * -EPROTO if a later version wrote it; -ENOSPC, -ENOMEM, -EIO. */
int ledger_file_prepare(const char *path, struct error *e);
/* Renames the file to PATH.damaged, together with its WAL. */
int ledger_file_rename_damaged(const char *path, struct error *e);
/* Opens the file. *db must be closed even after an error. */
int ledger_file_open(const char *path, sqlite3 **db, struct error *e);
/* Attaches the file to db under the name `schema`. */
int ledger_file_attach(sqlite3 *db, const char *path, const char *schema, struct error *e);
/* Runs statements that return no rows. */
int ledger_file_run(sqlite3 *db, const char *sql, struct error *e);
/* Sets e to SQLite's last error and returns its code as -errno. */
int ledger_file_set_error(sqlite3 *db, struct error *e);

#endif
