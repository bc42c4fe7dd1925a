/* SPDX-License-Identifier: Apache-2.0 */
/* Each file is opened alone first, so that an error can be attributed to one of the two. */
#include "coordinator/store/ledger_file.h"

#include "common/base/disk.h"
#include "common/base/text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The n-th statement upgrades a file of version n to n + 1; statements are never changed, only added. Rows of
 * versions before 4 have no checksum; theirs is -1, and they are trusted. */
static const char *const migrations[] = {
	"CREATE TABLE jobs (id INTEGER PRIMARY KEY, owner TEXT NOT NULL, name TEXT NOT NULL, version TEXT NOT NULL,"
	" priority INTEGER NOT NULL, mixed INTEGER NOT NULL, state TEXT NOT NULL, submitted REAL NOT NULL, ended REAL,"
	" submission BLOB, plan BLOB) STRICT;",
	"ALTER TABLE jobs ADD COLUMN held TEXT NOT NULL DEFAULT '';",
	"ALTER TABLE jobs ADD COLUMN extended INTEGER NOT NULL DEFAULT 0;",
	"ALTER TABLE jobs ADD COLUMN revision INTEGER NOT NULL DEFAULT 0; ALTER TABLE jobs ADD COLUMN checksum INTEGER;"
	"UPDATE jobs SET checksum = -1;",
	"ALTER TABLE jobs ADD COLUMN record TEXT NOT NULL DEFAULT ''; DROP INDEX IF EXISTS living;"
	"CREATE TABLE notes (name TEXT PRIMARY KEY, text TEXT NOT NULL, revision INTEGER NOT NULL) STRICT;",
};
enum { VERSION = sizeof migrations / sizeof *migrations, PATH_SIZE = 4300 };

int ledger_file_set_error(sqlite3 *db, struct error *e)
{
	int code = sqlite3_errcode(db);
	int errno_value = code == SQLITE_FULL				    ? ENOSPC
			  : code == SQLITE_NOMEM			    ? ENOMEM
			  : code == SQLITE_NOTADB || code == SQLITE_CORRUPT ? EBADMSG
									    : EIO;
	return error_set(e, errno_value, "the database of jobs: %s", sqlite3_errmsg(db));
}

int ledger_file_run(sqlite3 *db, const char *sql, struct error *e)
{
	return sqlite3_exec(db, sql, NULL, NULL, NULL) == SQLITE_OK ? 0 : ledger_file_set_error(db, e);
}

static int configure_schema(sqlite3 *db, const char *schema, struct error *e)
{
	char sql[200];
	snprintf(sql, sizeof sql,
		 "PRAGMA %s.journal_mode = WAL; PRAGMA %s.synchronous = FULL; PRAGMA %s.journal_size_limit = 1048576",
		 schema, schema, schema);
	return ledger_file_run(db, sql, e);
}

int ledger_file_open(const char *path, sqlite3 **db, struct error *e)
{
	int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX;
	if (sqlite3_open_v2(path, db, flags, NULL) != SQLITE_OK)
		return *db ? ledger_file_set_error(*db, e) : error_set(e, ENOMEM, "no memory for the database of jobs");
	/* The lock of the spool excludes other processes; exclusive locking needs no shared memory, so it works on
	 * any file system. */
	int rc = ledger_file_run(*db, "PRAGMA locking_mode = EXCLUSIVE; PRAGMA trusted_schema = OFF", e);
	return rc ? rc : configure_schema(*db, "main", e);
}

int ledger_file_attach(sqlite3 *db, const char *path, const char *schema, struct error *e)
{
	char *sql = sqlite3_mprintf("ATTACH %Q AS %s", path, schema);
	int rc = sql ? ledger_file_run(db, sql, e) : error_set(e, ENOMEM, "no memory for the database of jobs");
	sqlite3_free(sql);
	return rc ? rc : configure_schema(db, schema, e);
}

/* Returns the first column of the first row as text. */
static int query_text(sqlite3 *db, const char *sql, char *text, size_t size, struct error *e)
{
	sqlite3_stmt *s = NULL;
	int rc = sqlite3_prepare_v2(db, sql, -1, &s, NULL) == SQLITE_OK && sqlite3_step(s) == SQLITE_ROW
			 ? 0
			 : ledger_file_set_error(db, e);
	const void *column = rc ? NULL : sqlite3_column_text(s, 0);
	text_copy(text, size, column ? column : "");
	sqlite3_finalize(s);
	return rc;
}

static int migrate(sqlite3 *db, struct error *e)
{
	char text[32], commit_sql[64];
	long version = 0;
	int rc = query_text(db, "PRAGMA user_version", text, sizeof text, e);
	if (!rc)
		version = strtol(text, NULL, 10);
	if (rc || version == VERSION)
		return rc;
	if (version > VERSION)
		return error_set(
			e, EPROTO,
			"the database of jobs has version %ld, and this coordinator knows version %d: a later one wrote it",
			version, (int)VERSION);
	if (version < 0)
		return error_set(e, EBADMSG, "the database of jobs is damaged: no coordinator writes a version %ld",
				 version);
	snprintf(commit_sql, sizeof commit_sql, "PRAGMA user_version = %d; COMMIT", (int)VERSION);
	rc = ledger_file_run(db, "BEGIN IMMEDIATE", e);
	for (; !rc && version < VERSION; version++)
		rc = ledger_file_run(db, migrations[version], e);
	return rc ? rc : ledger_file_run(db, commit_sql, e);
}

int ledger_file_prepare(const char *path, struct error *e)
{
	sqlite3 *db = NULL;
	char text[200];
	int rc = ledger_file_open(path, &db, e);
	if (!rc)
		rc = migrate(db, e);
	if (!rc)
		rc = query_text(db, "PRAGMA integrity_check(1)", text, sizeof text, e);
	if (!rc && strcmp(text, "ok") != 0)
		rc = error_set(e, EBADMSG, "the database of jobs is damaged: %s", text);
	sqlite3_close(db);
	return rc ? error_prefix(e, rc, "%s", path) : 0;
}

int ledger_file_rename_damaged(const char *path, struct error *e)
{
	static const char *const suffixes[] = {"", "-wal", "-shm"};
	char from[PATH_SIZE], to[PATH_SIZE];
	for (int i = 0; i < 3; i++) {
		text_print(from, sizeof from, "%s%s", path, suffixes[i]);
		text_print(to, sizeof to, "%s.damaged%s", path, suffixes[i]);
		if (disk_rename(from, to) && errno != ENOENT)
			return error_file(e, errno, to);
	}
	*strrchr(to, '/') = 0;
	return disk_sync_folder(to, e);
}
