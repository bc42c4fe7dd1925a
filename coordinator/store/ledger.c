/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The jobs in an SQLite database: one row each, with a checksum over its columns.
 *
 * ledger_open upgrades an older scheme and checks all rows. A change reads its row first, so that a damaged one is
 * noticed instead of getting a new checksum, and commits before it returns (WAL, synchronous FULL). ledger_next
 * iterates over the jobs that have not ended, ledger_after over all.
 *
 * A damaged row is -EBADMSG, with its number still known. A full disk is -ENOSPC, a file that is no database -EBADMSG,
 * any other fault of SQLite -EIO or -ENOMEM. A newer scheme is -EPROTO.
 */
#include "coordinator/store/ledger.h"

#include "common/base/crc.h"
#include "common/base/mem.h"

#include <sqlite3.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

struct ledger {
	sqlite3 *db;
	sqlite3_stmt *add, *change, *drop, *remove, *next, *get, *all;
};

/* The n-th upgrades a database of version n to n + 1; never changed, only added to. */
static const char *const migrations[] = {
	"CREATE TABLE jobs (id INTEGER PRIMARY KEY, owner TEXT NOT NULL, name TEXT NOT NULL, version TEXT NOT NULL,"
	" priority INTEGER NOT NULL, mixed INTEGER NOT NULL, state TEXT NOT NULL, submitted REAL NOT NULL, ended REAL,"
	" submission BLOB, plan BLOB) STRICT;"
	"CREATE INDEX living ON jobs (id) WHERE ended IS NULL;",
	"ALTER TABLE jobs ADD COLUMN held TEXT NOT NULL DEFAULT '';",
	"ALTER TABLE jobs ADD COLUMN extended INTEGER NOT NULL DEFAULT 0;",
	"ALTER TABLE jobs ADD COLUMN revision INTEGER NOT NULL DEFAULT 0; ALTER TABLE jobs ADD COLUMN checksum INTEGER;",
};
enum { VERSION = sizeof migrations / sizeof *migrations };

#define COLUMNS \
	"id, owner, name, version, priority, mixed, submitted, submission, plan, held, extended, state, ended, revision, checksum"

static int fault(const struct ledger *l, struct error *e)
{
	int code = sqlite3_errcode(l->db);
	int as = code == SQLITE_FULL				   ? ENOSPC
		 : code == SQLITE_NOMEM				   ? ENOMEM
		 : code == SQLITE_NOTADB || code == SQLITE_CORRUPT ? EBADMSG
								   : EIO;
	return error_set(e, as, "the database of jobs: %s", sqlite3_errmsg(l->db));
}

static int run_statements(struct ledger *l, const char *sql, struct error *e)
{
	return sqlite3_exec(l->db, sql, NULL, NULL, NULL) == SQLITE_OK ? 0 : fault(l, e);
}

static int prepare(struct ledger *l, sqlite3_stmt **s, const char *sql, struct error *e)
{
	return sqlite3_prepare_v3(l->db, sql, -1, SQLITE_PREPARE_PERSISTENT, s, NULL) == SQLITE_OK ? 0 : fault(l, e);
}

static int version_of(struct ledger *l, int *version, struct error *e)
{
	sqlite3_stmt *s = NULL;
	int rc = prepare(l, &s, "PRAGMA user_version", e);
	if (!rc && sqlite3_step(s) != SQLITE_ROW)
		rc = fault(l, e);
	*version = rc ? 0 : sqlite3_column_int(s, 0);
	sqlite3_finalize(s);
	return rc;
}

static int migrate(struct ledger *l, struct error *e)
{
	int version;
	int rc = version_of(l, &version, e);
	if (!rc && version > VERSION)
		return error_set(
			e, EPROTO,
			"the database of jobs has version %d, and this coordinator knows version %d: a later one wrote it",
			version, (int)VERSION);
	if (!rc && version < 0)
		return error_set(e, EBADMSG, "the database of jobs is damaged: no coordinator writes a version %d",
				 version);
	for (; !rc && version < VERSION; version++) {
		char done[64];
		snprintf(done, sizeof done, "PRAGMA user_version = %d; COMMIT", version + 1);
		rc = run_statements(l, "BEGIN IMMEDIATE", e);
		if (!rc)
			rc = run_statements(l, migrations[version], e);
		if (!rc)
			rc = run_statements(l, done, e);
	}
	return rc;
}

/* ---- rows ---- */

static uint32_t check_text(uint32_t crc, const char *text)
{
	return crc32c(crc, text, strlen(text) + 1);
}

/* The checksum of everything in a row. */
static uint32_t check(const struct ledger_job *j)
{
	const struct {
		uint64_t id, extended, revision, submission_size, plan_size;
		double submitted, ended;
		int32_t priority, mixed;
	} numbers = {j->id,    j->extended, j->revision, j->submission_size, j->plan_size, j->submitted,
		     j->ended, j->priority, j->mixed};
	uint32_t crc = crc32c(0, &numbers, sizeof numbers);
	crc = check_text(crc, j->owner);
	crc = check_text(crc, j->name);
	crc = check_text(crc, j->version);
	crc = check_text(crc, j->held);
	crc = check_text(crc, j->state);
	crc = crc32c(crc, j->submission, j->submission_size);
	return crc32c(crc, j->plan, j->plan_size);
}

static const char *text_at(sqlite3_stmt *s, int column)
{
	const void *text = sqlite3_column_text(s, column);
	return text ? text : "";
}

static int row(struct ledger *l, sqlite3_stmt *s, uint64_t id, struct ledger_job *j, struct error *e)
{
	sqlite3_reset(s); /* here, so that the previous answer was valid until now */
	sqlite3_bind_int64(s, 1, (sqlite3_int64)id);
	int rc = sqlite3_step(s);
	if (rc != SQLITE_ROW) {
		rc = rc == SQLITE_DONE ? 0 : fault(l, e);
		sqlite3_reset(s);
		return rc;
	}
	*j = (struct ledger_job){.id = (uint64_t)sqlite3_column_int64(s, 0),
				 .owner = text_at(s, 1),
				 .name = text_at(s, 2),
				 .version = text_at(s, 3),
				 .priority = sqlite3_column_int(s, 4),
				 .mixed = sqlite3_column_int(s, 5),
				 .submitted = sqlite3_column_double(s, 6),
				 .held = text_at(s, 9),
				 .extended = (uint64_t)sqlite3_column_int64(s, 10),
				 .state = text_at(s, 11),
				 .ended = sqlite3_column_double(s, 12),
				 .revision = (uint64_t)sqlite3_column_int64(s, 13)};
	j->submission = sqlite3_column_blob(s, 7);
	j->submission_size = (size_t)sqlite3_column_bytes(s, 7);
	j->plan = sqlite3_column_blob(s, 8);
	j->plan_size = (size_t)sqlite3_column_bytes(s, 8);
	j->damaged = (uint64_t)sqlite3_column_int64(s, 14) != check(j);
	return 1;
}

/* Runs a statement that returns no rows. */
static int finish(struct ledger *l, sqlite3_stmt *s, struct error *e)
{
	int rc = sqlite3_step(s) == SQLITE_DONE ? 0 : fault(l, e);
	sqlite3_reset(s);
	sqlite3_clear_bindings(s);
	return rc;
}

/* Copies everything in a row, which may be one that was read. */
static void bind(sqlite3_stmt *s, const struct ledger_job *j)
{
	sqlite3_bind_int64(s, 1, (sqlite3_int64)j->id);
	sqlite3_bind_text(s, 2, j->owner, -1, SQLITE_TRANSIENT);
	sqlite3_bind_text(s, 3, j->name, -1, SQLITE_TRANSIENT);
	sqlite3_bind_text(s, 4, j->version, -1, SQLITE_TRANSIENT);
	sqlite3_bind_int(s, 5, j->priority);
	sqlite3_bind_int(s, 6, j->mixed);
	sqlite3_bind_double(s, 7, j->submitted);
	if (j->submission_size)
		sqlite3_bind_blob64(s, 8, j->submission, j->submission_size, SQLITE_TRANSIENT);
	if (j->plan_size)
		sqlite3_bind_blob64(s, 9, j->plan, j->plan_size, SQLITE_TRANSIENT);
	sqlite3_bind_text(s, 10, j->held, -1, SQLITE_TRANSIENT);
	sqlite3_bind_int64(s, 11, (sqlite3_int64)j->extended);
	sqlite3_bind_text(s, 12, j->state, -1, SQLITE_TRANSIENT);
	if (j->ended > 0)
		sqlite3_bind_double(s, 13, j->ended);
	sqlite3_bind_int64(s, 14, (sqlite3_int64)j->revision);
	sqlite3_bind_int64(s, 15, check(j));
}

/* 0: there is none. */
static int get_whole(struct ledger *l, uint64_t id, struct ledger_job *j, struct error *e)
{
	int rc = row(l, l->get, id, j, e);
	return rc > 0 && j->damaged ? error_set(e, EBADMSG, "the database of jobs: the row of j%llu is damaged",
						(unsigned long long)id)
				    : rc;
}

static int change(struct ledger *l, struct ledger_job *j, struct error *e)
{
	j->revision++;
	bind(l->change, j);
	sqlite3_reset(l->get);
	return finish(l, l->change, e);
}

/* ---- opening ---- */

static int look_through(struct ledger *l, struct error *e)
{
	sqlite3_stmt *s = NULL;
	int rc = prepare(l, &s, "PRAGMA integrity_check(1)", e);
	if (!rc && sqlite3_step(s) != SQLITE_ROW)
		rc = fault(l, e);
	if (!rc && strcmp(text_at(s, 0), "ok") != 0)
		rc = error_set(e, EBADMSG, "the database of jobs is damaged: %s", text_at(s, 0));
	sqlite3_finalize(s);
	return rc;
}

/* Rows of versions without checksums are trusted, once. */
static int make_checksums(struct ledger *l, struct error *e)
{
	sqlite3_stmt *s = NULL;
	struct ledger_job j;
	int rc =
		prepare(l, &s, "SELECT " COLUMNS " FROM jobs WHERE id > ? AND checksum IS NULL ORDER BY id LIMIT 1", e);
	uint64_t id = 0;
	while (!rc && (rc = row(l, s, id, &j, e)) > 0) {
		id = j.id;
		rc = change(l, &j, e);
	}
	sqlite3_finalize(s);
	return rc;
}

int ledger_open(struct ledger **out, const char *path, struct error *e)
{
	struct ledger *l = mem_alloc(1, sizeof *l);
	if (!l)
		return error_set(e, ENOMEM, "no memory for the database of jobs");
	int rc = 0;
	if (sqlite3_open_v2(path, &l->db, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX, NULL) !=
	    SQLITE_OK)
		rc = l->db ? fault(l, e) : error_set(e, ENOMEM, "no memory for the database of jobs");
	/* The spool's lock excludes others; without shared memory it works on any file system. */
	if (!rc)
		rc = run_statements(
			l,
			"PRAGMA locking_mode = EXCLUSIVE; PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL;"
			"PRAGMA journal_size_limit = 1048576; PRAGMA trusted_schema = OFF",
			e);
	if (!rc)
		rc = migrate(l, e);
	if (!rc)
		rc = look_through(l, e);
	if (!rc)
		rc = prepare(l, &l->add,
			     "INSERT INTO jobs (" COLUMNS ") VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)", e);
	if (!rc)
		rc = prepare(
			l, &l->change,
			"UPDATE jobs SET owner = ?2, name = ?3, version = ?4, priority = ?5, mixed = ?6, submitted = ?7, submission = ?8,"
			" plan = ?9, held = ?10, extended = ?11, state = ?12, ended = ?13, revision = ?14, checksum = ?15 WHERE id = ?1",
			e);
	if (!rc)
		rc = prepare(l, &l->remove, "DELETE FROM jobs WHERE id = ?1", e);
	if (!rc)
		rc = prepare(l, &l->drop, "DELETE FROM jobs WHERE id = ?1 AND ended IS NOT NULL", e);
	if (!rc)
		rc = prepare(l, &l->next,
			     "SELECT " COLUMNS " FROM jobs WHERE ended IS NULL AND id > ? ORDER BY id LIMIT 1", e);
	if (!rc)
		rc = prepare(l, &l->get, "SELECT " COLUMNS " FROM jobs WHERE id = ?", e);
	if (!rc)
		rc = prepare(l, &l->all, "SELECT " COLUMNS " FROM jobs WHERE id > ? ORDER BY id LIMIT 1", e);
	if (!rc)
		rc = make_checksums(l, e);
	if (rc) {
		ledger_close(l);
		return rc == -EPROTO ? rc : error_prefix(e, rc, "%s", path);
	}
	*out = l;
	return 0;
}

void ledger_close(struct ledger *l)
{
	if (!l)
		return;
	sqlite3_finalize(l->add);
	sqlite3_finalize(l->change);
	sqlite3_finalize(l->remove);
	sqlite3_finalize(l->all);
	sqlite3_finalize(l->get);
	sqlite3_finalize(l->drop);
	sqlite3_finalize(l->next);
	sqlite3_close(l->db);
	mem_free(l);
}

int ledger_add(struct ledger *l, const struct ledger_job *j, struct error *e)
{
	struct ledger_job live = *j;
	live.state = "live";
	live.ended = 0;
	live.held = "";
	bind(l->add, &live);
	return finish(l, l->add, e);
}

int ledger_put(struct ledger *l, const struct ledger_job *j, struct error *e)
{
	int rc = run_statements(l, "BEGIN IMMEDIATE", e);
	if (rc)
		return rc;
	sqlite3_bind_int64(l->remove, 1, (sqlite3_int64)j->id);
	rc = finish(l, l->remove, e);
	bind(l->add, j);
	if (!rc)
		rc = finish(l, l->add, e);
	if (!rc)
		rc = run_statements(l, "COMMIT", e);
	if (rc)
		run_statements(l, "ROLLBACK", NULL);
	return rc;
}

int ledger_forget(struct ledger *l, uint64_t id, struct error *e)
{
	sqlite3_bind_int64(l->remove, 1, (sqlite3_int64)id);
	return finish(l, l->remove, e);
}

int ledger_end(struct ledger *l, uint64_t id, uint64_t extended, const char *state, struct error *e)
{
	struct timespec now;
	struct ledger_job j;
	int rc = get_whole(l, id, &j, e);
	if (rc <= 0 || j.ended > 0 || j.extended != extended)
		return rc < 0 ? rc : 0;
	clock_gettime(CLOCK_REALTIME, &now);
	j.ended = now.tv_sec > 0 ? (double)now.tv_sec : 1;
	j.state = state;
	j.held = "";
	j.submission = j.plan = NULL;
	j.submission_size = j.plan_size = 0;
	return change(l, &j, e);
}

int ledger_drop(struct ledger *l, const uint64_t *ids, size_t count, struct error *e)
{
	int rc = run_statements(l, "BEGIN IMMEDIATE", e);
	if (rc)
		return rc;
	for (size_t i = 0; !rc && i < count; i++) {
		sqlite3_bind_int64(l->drop, 1, (sqlite3_int64)ids[i]);
		rc = finish(l, l->drop, e);
	}
	if (!rc)
		rc = run_statements(l, "COMMIT", e);
	if (rc)
		run_statements(l, "ROLLBACK", NULL);
	return rc;
}

int ledger_hold(struct ledger *l, uint64_t id, const char *who, struct error *e)
{
	struct ledger_job j;
	int rc = get_whole(l, id, &j, e);
	j.held = who;
	return rc > 0 ? change(l, &j, e) : rc;
}

int ledger_priority(struct ledger *l, uint64_t id, int priority, struct error *e)
{
	struct ledger_job j;
	int rc = get_whole(l, id, &j, e);
	j.priority = priority;
	return rc > 0 ? change(l, &j, e) : rc;
}

int ledger_extend(struct ledger *l, const struct ledger_job *more, struct error *e)
{
	struct ledger_job j;
	int rc = get_whole(l, more->id, &j, e);
	if (rc <= 0)
		return rc < 0 ? rc
			      : error_set(e, ENOENT, "the database of jobs has no j%llu", (unsigned long long)more->id);
	j.submission = more->submission;
	j.submission_size = more->submission_size;
	j.plan = more->plan;
	j.plan_size = more->plan_size;
	j.extended = more->extended;
	j.ended = 0;
	j.state = "live";
	return change(l, &j, e);
}

int ledger_next(struct ledger *l, uint64_t after, struct ledger_job *j, struct error *e)
{
	int rc = row(l, l->next, after, j, e);
	if (rc > 0 && j->id <= after) /* otherwise a caller that asks for the next one would never stop */
		return error_set(e, EBADMSG, "jobs.db is damaged: its jobs are not in order");
	return rc;
}

int ledger_after(struct ledger *l, uint64_t after, struct ledger_job *j, struct error *e)
{
	int rc = row(l, l->all, after, j, e);
	return rc > 0 && j->id <= after ? error_set(e, EBADMSG, "jobs.db is damaged: its jobs are not in order") : rc;
}

int ledger_get(struct ledger *l, uint64_t id, struct ledger_job *j, struct error *e)
{
	return row(l, l->get, id, j, e);
}
