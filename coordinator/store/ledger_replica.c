/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The statements of one file of the ledger: a row per job and notes by name, each with a checksum over all of its
 * columns.
 *
 * Statements are prepared once. A row is read in place and stays valid until the next call. A row is written in two
 * steps, binding and stepping, so that a row that was just read can be written to the other file.
 *
 * A row whose checksum does not match is returned with `is_damaged` set, a note with -EBADMSG; the caller decides how
 * to go on without it. Errors of SQLite are returned with SQLite's own message.
 */
#include "coordinator/store/ledger_replica.h"

#include "common/base/bytes.h"
#include "common/base/crc.h"
#include "common/base/mem.h"
#include "coordinator/store/ledger_file.h"
#include "coordinator/store/note.h"

#include <stdio.h>
#include <string.h>

#define COLUMNS \
	"id, owner, name, version, priority, mixed, submitted, submission, plan, held, extended, state, ended, revision, checksum, record"

enum { NO_CHECKSUM = -1 }; /* checksum of a row written by a version without checksums (ledger_file.c) */

/* Text before and after the name of the schema. */
static const char *const statement_sql[LEDGER_STATEMENT_COUNT][2] = {
	[LEDGER_PUT] = {"INSERT OR REPLACE INTO ",
			".jobs (" COLUMNS ") VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)"},
	[LEDGER_REMOVE] = {"DELETE FROM ", ".jobs WHERE id = ?"},
	[LEDGER_GET] = {"SELECT " COLUMNS " FROM ", ".jobs WHERE id = ?"},
	[LEDGER_GET_NEXT] = {"SELECT " COLUMNS " FROM ", ".jobs WHERE id > ? ORDER BY id LIMIT 1"},
	[LEDGER_SET_NOTE] = {"INSERT INTO ", ".notes (name, text, revision) VALUES (?1, ?2, 1)"
					     " ON CONFLICT (name) DO UPDATE SET text = ?2, revision = revision + 1"},
	[LEDGER_GET_NOTE] = {"SELECT text FROM ", ".notes WHERE name = ?"},
};

int ledger_replica_open(struct ledger_replica *s, sqlite3 *db, const char *schema, struct error *e)
{
	s->db = db;
	for (int i = 0; i < LEDGER_STATEMENT_COUNT; i++) {
		char text[400];
		snprintf(text, sizeof text, "%s%s%s", statement_sql[i][0], schema, statement_sql[i][1]);
		if (sqlite3_prepare_v3(db, text, -1, SQLITE_PREPARE_PERSISTENT, &s->statements[i], NULL) != SQLITE_OK)
			return ledger_file_set_error(db, e);
	}
	return 0;
}

void ledger_replica_close(struct ledger_replica *s)
{
	for (int i = 0; i < LEDGER_STATEMENT_COUNT; i++)
		sqlite3_finalize(s->statements[i]);
}

static int run_statement(struct ledger_replica *s, enum ledger_statement which, struct error *e)
{
	int rc = sqlite3_step(s->statements[which]) == SQLITE_DONE ? 0 : ledger_file_set_error(s->db, e);
	sqlite3_reset(s->statements[which]);
	sqlite3_clear_bindings(s->statements[which]);
	return rc;
}

static uint32_t add_text_to_crc(uint32_t crc, const char *text)
{
	return crc32c(crc, text, strlen(text) + 1);
}

/* Returns the checksum of all columns of a row. */
static uint32_t row_checksum(const struct ledger_job *j)
{
	unsigned char numbers[64];
	put64(numbers, j->id);
	put64(numbers + 8, j->extended);
	put64(numbers + 16, j->revision);
	put64(numbers + 24, j->submission_size);
	put64(numbers + 32, j->plan_size);
	put_double(numbers + 40, j->submitted);
	put_double(numbers + 48, j->end_time);
	put32(numbers + 56, (uint32_t)j->priority);
	put32(numbers + 60, j->is_mixed);
	uint32_t crc = crc32c(0, numbers, sizeof numbers);
	crc = add_text_to_crc(crc, j->owner);
	crc = add_text_to_crc(crc, j->name);
	crc = add_text_to_crc(crc, j->version);
	crc = add_text_to_crc(crc, j->holder);
	crc = add_text_to_crc(crc, j->state);
	crc = crc32c(crc, j->submission, j->submission_size);
	crc = crc32c(crc, j->plan, j->plan_size);
	/* Rows of version 4 have no record, and their checksum does not include one. */
	return *j->record ? add_text_to_crc(crc, j->record) : crc;
}

static const char *column_text(sqlite3_stmt *s, int column)
{
	const void *text = sqlite3_column_text(s, column);
	return text ? text : "";
}

static int read_row(struct ledger_replica *side, enum ledger_statement which, uint64_t id, struct ledger_job *j,
		    struct error *e)
{
	sqlite3_stmt *s = side->statements[which];
	sqlite3_reset(s); /* not earlier, so that the previous row was valid until now */
	sqlite3_bind_int64(s, 1, (sqlite3_int64)id);
	int rc = sqlite3_step(s);
	if (rc != SQLITE_ROW) {
		rc = rc == SQLITE_DONE ? 0 : ledger_file_set_error(side->db, e);
		sqlite3_reset(s);
		return rc;
	}
	*j = (struct ledger_job){.id = (uint64_t)sqlite3_column_int64(s, 0),
				 .owner = column_text(s, 1),
				 .name = column_text(s, 2),
				 .version = column_text(s, 3),
				 .priority = sqlite3_column_int(s, 4),
				 .is_mixed = sqlite3_column_int(s, 5),
				 .submitted = sqlite3_column_double(s, 6),
				 .holder = column_text(s, 9),
				 .extended = (uint64_t)sqlite3_column_int64(s, 10),
				 .state = column_text(s, 11),
				 .end_time = sqlite3_column_double(s, 12),
				 .revision = (uint64_t)sqlite3_column_int64(s, 13),
				 .record = column_text(s, 15)};
	j->submission = sqlite3_column_blob(s, 7);
	j->submission_size = (size_t)sqlite3_column_bytes(s, 7);
	j->plan = sqlite3_column_blob(s, 8);
	j->plan_size = (size_t)sqlite3_column_bytes(s, 8);
	sqlite3_int64 checksum = sqlite3_column_int64(s, 14);
	j->is_damaged = checksum != row_checksum(j) && checksum != NO_CHECKSUM;
	return 1;
}

int ledger_replica_get(struct ledger_replica *s, uint64_t id, struct ledger_job *j, struct error *e)
{
	return read_row(s, LEDGER_GET, id, j, e);
}

int ledger_replica_get_next(struct ledger_replica *s, uint64_t id, struct ledger_job *j, struct error *e)
{
	int rc = read_row(s, LEDGER_GET_NEXT, id, j, e);
	/* A caller that walks through all rows would never stop. */
	return rc > 0 && j->id <= id
		       ? error_set(e, EBADMSG, "the database of jobs is damaged: its jobs are not in order")
		       : rc;
}

void ledger_replica_release(struct ledger_replica *s)
{
	sqlite3_reset(s->statements[LEDGER_GET]);
	sqlite3_reset(s->statements[LEDGER_GET_NEXT]);
}

static bool bind_text(sqlite3_stmt *s, int index, const char *text)
{
	return sqlite3_bind_text(s, index, text, -1, SQLITE_TRANSIENT) == SQLITE_OK;
}

static bool bind_bytes(sqlite3_stmt *s, int index, const void *bytes, size_t size)
{
	return !size || sqlite3_bind_blob64(s, index, bytes, size, SQLITE_TRANSIENT) == SQLITE_OK;
}

int ledger_replica_bind(struct ledger_replica *side, const struct ledger_job *j, struct error *e)
{
	sqlite3_stmt *s = side->statements[LEDGER_PUT];
	sqlite3_clear_bindings(s);
	sqlite3_bind_int64(s, 1, (sqlite3_int64)j->id);
	sqlite3_bind_int(s, 5, j->priority);
	sqlite3_bind_int(s, 6, j->is_mixed);
	sqlite3_bind_double(s, 7, j->submitted);
	sqlite3_bind_int64(s, 11, (sqlite3_int64)j->extended);
	if (j->end_time > 0)
		sqlite3_bind_double(s, 13, j->end_time);
	sqlite3_bind_int64(s, 14, (sqlite3_int64)j->revision);
	sqlite3_bind_int64(s, 15, row_checksum(j));
	/* These values are copied, which takes memory; a value that is not bound would become NULL in the row. */
	if (bind_text(s, 2, j->owner) && bind_text(s, 3, j->name) && bind_text(s, 4, j->version) &&
	    bind_bytes(s, 8, j->submission, j->submission_size) && bind_bytes(s, 9, j->plan, j->plan_size) &&
	    bind_text(s, 10, j->holder) && bind_text(s, 12, j->state) && bind_text(s, 16, j->record))
		return 0;
	int rc = ledger_file_set_error(side->db, e);
	sqlite3_clear_bindings(s);
	return rc;
}

int ledger_replica_put(struct ledger_replica *s, struct error *e)
{
	return run_statement(s, LEDGER_PUT, e);
}

int ledger_replica_remove(struct ledger_replica *s, uint64_t id, struct error *e)
{
	sqlite3_bind_int64(s->statements[LEDGER_REMOVE], 1, (sqlite3_int64)id);
	return run_statement(s, LEDGER_REMOVE, e);
}

int ledger_replica_set_note(struct ledger_replica *s, const char *name, const char *text, struct error *e)
{
	char *stored = note_add_checksum(name, text);
	if (!stored)
		return error_set(e, ENOMEM, "no memory for %s", name);
	sqlite3_bind_text(s->statements[LEDGER_SET_NOTE], 1, name, -1, SQLITE_STATIC);
	sqlite3_bind_text(s->statements[LEDGER_SET_NOTE], 2, stored, -1, SQLITE_STATIC);
	int rc = run_statement(s, LEDGER_SET_NOTE, e);
	mem_free(stored);
	return rc;
}

static int read_note_text(const char *name, const char *stored, char **text, struct error *e)
{
	size_t size;
	if (note_rank(name, stored, &size) == NOTE_DAMAGED)
		return error_set(e, EBADMSG, "the note %s is damaged in jobs.db and in jobs-copy.db", name);
	*text = mem_strdup(stored);
	if (!*text)
		return error_set(e, ENOMEM, "no memory for %s", name);
	(*text)[size] = 0;
	return 0;
}

int ledger_replica_get_note(struct ledger_replica *side, const char *name, char **text, struct error *e)
{
	sqlite3_stmt *s = side->statements[LEDGER_GET_NOTE];
	sqlite3_bind_text(s, 1, name, -1, SQLITE_STATIC);
	int rc = sqlite3_step(s);
	if (rc == SQLITE_ROW)
		rc = read_note_text(name, column_text(s, 0), text, e);
	else
		rc = rc == SQLITE_DONE ? error_set(e, ENOENT, "there is no %s", name)
				       : ledger_file_set_error(side->db, e);
	sqlite3_reset(s);
	return rc;
}
