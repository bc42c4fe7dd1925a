/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The database of jobs, in two files: jobs.db, and jobs-copy.db, which is attached to the connection of jobs.db as
 * schema `copy`.
 *
 * ledger_open prepares each file alone (ledger_file.h), then compares their rows: of two undamaged rows the one with
 * the higher revision counts, and replaces the other. A change reads the row of jobs.db first, so that a damaged row
 * is noticed instead of getting a new checksum; it writes the row there with the next revision, and then writes the
 * copy. Once both files are open, no transaction writes both, because SQLite does not commit two WALs at once.
 *
 * A row that is damaged in both files is -EBADMSG, with its number still known. A full disk is -ENOSPC, a file that
 * is no database -EBADMSG, any other fault of SQLite -EIO or -ENOMEM. If the copy cannot be written, the call
 * succeeds, `behind` is set, and nothing is written to the copy before ledger_mend has compared the files again.
 */
#include "coordinator/store/ledger.h"

#include "common/base/clock.h"
#include "common/base/list.h"
#include "common/base/log.h"
#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/store/ledger_file.h"
#include "coordinator/store/ledger_side.h"
#include "coordinator/store/note.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PATH_MOST = 4200, SQL_MOST = 400, SIDES = 2 };

static const char *const names[SIDES] = {"jobs.db", "jobs-copy.db"}, *const schemas[SIDES] = {"main", "copy"};
static const char next_job[] = "next-job";

struct ledger {
	sqlite3 *db;
	struct ledger_side jobs, copy;
	uint64_t next; /* id of the next job */
	bool is_new;
	bool behind;  /* changes are missing in the copy */
	bool counted; /* ended_count is valid */
	uint64_t ended_count;
	double last_end; /* latest end in all rows; 0: not read yet */
};

/* Commits the transaction if rc is 0, otherwise rolls it back. Returns rc or the error of the commit. */
static int end_transaction(struct ledger *l, int rc, struct error *e)
{
	if (!rc)
		rc = ledger_file_run(l->db, "COMMIT", e);
	if (rc)
		ledger_file_run(l->db, "ROLLBACK", NULL);
	return rc;
}

static void fall_behind(struct ledger *l, const struct error *e)
{
	l->behind = true;
	log_event(LOG_SPOOL_FAULT, "file=%s text=%s action=\"it will be tried again\"", names[1],
		  log_quote(e->text).text);
}

static void log_repair(const struct ledger_job *j, const char *what)
{
	log_event(LOG_SPOOL_FAULT, "job=j%llu text=\"its row in %s\"", (unsigned long long)j->id, what);
}

static int write_row(struct ledger_side *s, const struct ledger_job *j, struct error *e)
{
	int rc = ledger_side_bind(s, j, e);
	return rc ? rc : ledger_side_put(s, e);
}

/* Makes both files contain the better of two versions of a row. a: the row in jobs.db, b: in the copy; at most one of
 * them is NULL. */
static int merge_row(struct ledger *l, const struct ledger_job *a, const struct ledger_job *b, struct error *e)
{
	bool use_a = a && !a->damaged, use_b = b && !b->damaged;
	if (use_b && (!use_a || b->revision > a->revision)) {
		log_repair(b, !a      ? "jobs.db was lost: restored from jobs-copy.db"
			      : use_a ? "jobs.db was older than in jobs-copy.db: restored from there"
				      : "jobs.db was damaged: restored from jobs-copy.db");
		return write_row(&l->jobs, b, e);
	}
	if (!use_a || (use_b && a->revision == b->revision))
		return 0;
	if (b && !use_b)
		log_repair(a, "jobs-copy.db was damaged: restored from jobs.db");
	return write_row(&l->copy, a, e);
}

static int merge_rows(struct ledger *l, struct error *e)
{
	int rc = 0;
	for (uint64_t id = 0; !rc;) {
		struct ledger_job a, b;
		int has_a = ledger_side_after(&l->jobs, id, &a, e);
		int has_b = has_a < 0 ? 0 : ledger_side_after(&l->copy, id, &b, e);
		rc = has_a < 0 ? has_a : has_b < 0 ? has_b : 0;
		if (rc || (!has_a && !has_b))
			break;
		id = !has_b || (has_a && a.id < b.id) ? a.id : b.id;
		rc = merge_row(l, has_a && a.id == id ? &a : NULL, has_b && b.id == id ? &b : NULL, e);
	}
	ledger_side_release(&l->jobs);
	ledger_side_release(&l->copy);
	return rc;
}

/* Deletes the notes in one file that have a worse checksum than in the other file (note_rank), so that merge_notes
 * restores them. */
static int drop_damaged(struct ledger *l, int side, struct error *e)
{
	char sql[SQL_MOST];
	text_print(sql, sizeof sql,
		   "DELETE FROM %s.notes AS n WHERE EXISTS (SELECT 1 FROM %s.notes AS o WHERE o.name = n.name"
		   " AND note_rank(o.name, o.text) > note_rank(n.name, n.text))",
		   schemas[side], schemas[!side]);
	int before = sqlite3_total_changes(l->db), rc = ledger_file_run(l->db, sql, e);
	if (!rc && sqlite3_total_changes(l->db) > before)
		log_event(LOG_SPOOL_FAULT, "text=\"notes in %s were damaged: restored from %s\"", names[side],
			  names[!side]);
	return rc;
}

static int merge_notes(struct ledger *l, const char *from, const char *to, struct error *e)
{
	char sql[SQL_MOST];
	text_print(sql, sizeof sql,
		   "INSERT OR REPLACE INTO %s.notes SELECT * FROM %s.notes AS n WHERE NOT EXISTS"
		   " (SELECT 1 FROM %s.notes AS o WHERE o.name = n.name AND o.revision >= n.revision)",
		   to, from, to);
	return ledger_file_run(l->db, sql, e);
}

/* Brings the files to the same contents in one transaction. At the start it may write both, later, when the copy is
 * behind, only the copy. */
static int merge(struct ledger *l, struct error *e)
{
	ledger_side_release(&l->jobs);
	int rc = ledger_file_run(l->db, "BEGIN", e);
	if (rc)
		return rc;
	rc = merge_rows(l, e);
	if (!rc && !l->behind)
		rc = drop_damaged(l, 0, e);
	if (!rc)
		rc = drop_damaged(l, 1, e);
	if (!rc)
		rc = merge_notes(l, schemas[0], schemas[1], e);
	if (!rc && !l->behind)
		rc = merge_notes(l, schemas[1], schemas[0], e);
	return end_transaction(l, rc, e);
}

int ledger_mend(struct ledger *l, struct error *e)
{
	int rc = l->behind ? merge(l, e) : 0;
	l->behind = rc != 0;
	return rc;
}

/* Prepares a file. A damaged one is renamed and created anew; its contents then come from the other file. */
static int prepare_file(const char *path, int side, struct error *e)
{
	int rc = ledger_file_prepare(path, e);
	if (rc != -EBADMSG)
		return rc;
	log_event(LOG_SPOOL_FAULT, "text=%s action=\"it is kept as %s.damaged, and restored from %s\"",
		  log_quote(e->text).text, names[side], names[!side]);
	rc = ledger_file_keep_damaged(path, e);
	return rc ? rc : ledger_file_prepare(path, e);
}

static int open_both(struct ledger *l, const char *folder, struct error *e)
{
	char path[SIDES][PATH_MOST];
	int rc = 0;
	for (int s = 0; !rc && s < SIDES; s++) {
		text_print(path[s], PATH_MOST, "%s/%s", folder, names[s]);
		rc = prepare_file(path[s], s, e);
	}
	if (!rc)
		rc = ledger_file_open(path[0], &l->db, e);
	if (!rc)
		rc = ledger_file_attach(l->db, path[1], schemas[1], e);
	if (!rc)
		rc = note_register(l->db, e);
	if (!rc)
		rc = ledger_side_open(&l->jobs, l->db, schemas[0], e);
	return rc ? rc : ledger_side_open(&l->copy, l->db, schemas[1], e);
}

/* Makes sure that the next id is above this one. Returns false if it was already. */
static bool skip(struct ledger *l, uint64_t id)
{
	if (id < l->next || id >= UINT64_MAX / 2)
		return false;
	l->next = id + 1;
	return true;
}

/* Finds the next id, from its note and from the rows. */
static int find_next(struct ledger *l, struct error *e)
{
	char *text;
	uint64_t *ids;
	size_t count;
	l->next = 1;
	int rc = ledger_note(l, next_job, &text, e);
	l->is_new = rc == -ENOENT;
	if (!rc) {
		skip(l, strtoull(text, NULL, 10) - 1);
		mem_free(text);
	} else if (rc == -EBADMSG) {
		log_event(LOG_SPOOL_FAULT, "text=%s action=\"the next id is derived from the known jobs\"",
			  log_quote(e->text).text);
	} else if (rc != -ENOENT) {
		return rc;
	}
	rc = ledger_ids(l, LEDGER_ALL, &ids, &count, e);
	if (!rc && count) {
		skip(l, ids[count - 1]);
		l->is_new = false;
	}
	mem_free(ids);
	return rc;
}

int ledger_open(struct ledger **out, const char *folder, struct error *e)
{
	struct ledger *l = mem_alloc(1, sizeof *l);
	if (!l)
		return error_set(e, ENOMEM, "no memory for the database of jobs");
	int rc = open_both(l, folder, e);
	if (!rc)
		rc = merge(l, e);
	if (!rc)
		rc = find_next(l, e);
	if (rc)
		ledger_close(l);
	else
		*out = l;
	return rc;
}

void ledger_close(struct ledger *l)
{
	if (!l)
		return;
	ledger_side_close(&l->jobs);
	ledger_side_close(&l->copy);
	sqlite3_close(l->db);
	mem_free(l);
}

bool ledger_is_new(const struct ledger *l)
{
	return l->is_new;
}

static int put_both(struct ledger *l, const struct ledger_job *j, struct error *e)
{
	struct error fault;
	int rc = ledger_side_bind(&l->jobs, j, e);
	int behind = l->behind ? 0 : ledger_side_bind(&l->copy, j, &fault);
	ledger_side_release(&l->jobs); /* j's texts may have come from there */
	if (!rc)
		rc = ledger_side_put(&l->jobs, e);
	if (!rc && !l->behind && !behind)
		behind = ledger_side_put(&l->copy, &fault);
	if (!rc && behind)
		fall_behind(l, &fault);
	return rc;
}

static int change(struct ledger *l, struct ledger_job *j, struct error *e)
{
	j->revision++;
	return put_both(l, j, e);
}

static int get_whole(struct ledger *l, uint64_t id, struct ledger_job *j, struct error *e)
{
	int rc = ledger_side_get(&l->jobs, id, j, e);
	return rc > 0 && j->damaged ? error_set(e, EBADMSG, "the database of jobs: the row of j%llu is damaged",
						(unsigned long long)id)
				    : rc;
}

/* Like get_whole(), but returns 0, or -ENOENT if there is no such row. */
static int get_existing(struct ledger *l, uint64_t id, struct ledger_job *j, struct error *e)
{
	int rc = get_whole(l, id, j, e);
	return rc ? (rc < 0 ? rc : 0)
		  : error_set(e, ENOENT, "the database of jobs has no j%llu", (unsigned long long)id);
}

static int change_record(struct ledger *l, struct ledger_job *j, const struct job_record *r, struct error *e)
{
	char *record;
	int rc = record_to_json(r, &record, e);
	if (rc)
		return rc;
	j->record = record;
	rc = change(l, j, e);
	mem_free(record);
	return rc;
}

static void forget_submission(struct ledger_job *j)
{
	j->submission = j->plan = NULL;
	j->submission_size = j->plan_size = 0;
}

static int remove_all(struct ledger *l, struct ledger_side *s, const uint64_t *ids, size_t count, struct error *e)
{
	ledger_side_release(&l->jobs);
	int rc = ledger_file_run(l->db, "BEGIN", e);
	for (size_t i = 0; !rc && i < count; i++)
		rc = ids[i] ? ledger_side_remove(s, ids[i], e) : 0;
	return end_transaction(l, rc, e);
}

/* Deletes from the copy first: after a fault in between the rows still exist in jobs.db and are dropped later. */
static int remove_both(struct ledger *l, const uint64_t *ids, size_t count, struct error *e)
{
	int rc = remove_all(l, &l->copy, ids, count, e);
	return rc ? rc : remove_all(l, &l->jobs, ids, count, e);
}

uint64_t ledger_next_id(const struct ledger *l)
{
	return l->next;
}

int ledger_skip_ids(struct ledger *l, uint64_t id, struct error *e)
{
	char text[32];
	if (!skip(l, id))
		return 0;
	text_print(text, sizeof text, "%llu", (unsigned long long)l->next);
	return ledger_set(l, next_job, text, e);
}

/* Writes the row and the id after it in one transaction. */
static int add_to(struct ledger *l, struct ledger_side *s, const struct ledger_job *j, struct error *e)
{
	char next[32];
	text_print(next, sizeof next, "%llu", (unsigned long long)l->next);
	int rc = ledger_file_run(l->db, "BEGIN", e);
	if (!rc)
		rc = ledger_side_set(s, next_job, next, e);
	if (!rc)
		rc = write_row(s, j, e);
	return end_transaction(l, rc, e);
}

int ledger_add(struct ledger *l, const struct ledger_job *j, struct error *e)
{
	struct ledger_job live, old;
	struct error fault;
	int rc = ledger_side_get(&l->jobs, j->id, &old, e);
	if (rc)
		return rc < 0 ? rc
			      : error_set(e, EEXIST, "the database of jobs has a j%llu", (unsigned long long)j->id);
	skip(l, j->id);
	live = *j;
	live.state = "live";
	live.ended = 0;
	live.held = "";
	ledger_side_release(&l->jobs);
	rc = add_to(l, &l->jobs, &live, e);
	if (!rc && !l->behind && add_to(l, &l->copy, &live, &fault))
		fall_behind(l, &fault);
	return rc;
}

int ledger_put(struct ledger *l, const struct ledger_job *j, struct error *e)
{
	l->counted = false;
	return put_both(l, j, e);
}

int ledger_forget(struct ledger *l, uint64_t id, struct error *e)
{
	l->counted = false;
	return remove_both(l, &id, 1, e);
}

int ledger_drop(struct ledger *l, uint64_t *ids, size_t count, struct error *e)
{
	uint64_t dropped = 0;
	for (size_t i = 0; i < count; i++) {
		struct ledger_job j;
		int rc = ledger_side_get(&l->jobs, ids[i], &j, e);
		if (rc < 0)
			return rc;
		if (rc && !(j.ended > 0))
			ids[i] = 0;
		dropped += rc && j.ended > 0;
	}
	int rc = remove_both(l, ids, count, e);
	l->counted = l->counted && !rc;
	l->ended_count -= dropped;
	return rc;
}

/* Returns the time of the end of a job: now, but later than all earlier ends, even if a wrong clock was set back. */
static double time_of_end(struct ledger *l)
{
	static const char sql[] = "SELECT max(ended) FROM main.jobs";
	sqlite3_stmt *s = NULL;
	double now = clock_wall_seconds();
	if (l->last_end == 0 && sqlite3_prepare_v2(l->db, sql, -1, &s, NULL) == SQLITE_OK &&
	    sqlite3_step(s) == SQLITE_ROW)
		l->last_end = sqlite3_column_double(s, 0);
	sqlite3_finalize(s);
	return fmax(now, fmax(1, nextafter(l->last_end, INFINITY)));
}

int ledger_end(struct ledger *l, const struct job_record *r, bool extendable, struct error *e)
{
	struct ledger_job j;
	int rc = get_whole(l, r->id, &j, e);
	if (rc <= 0 || j.extended != r->extended)
		return rc < 0 ? rc : 0;
	bool ended = j.ended > 0;
	j.ended = time_of_end(l);
	j.state = r->state;
	j.held = "";
	if (!extendable)
		forget_submission(&j);
	double end = j.ended;
	rc = change_record(l, &j, r, e);
	l->last_end = rc ? l->last_end : end;
	l->ended_count += !rc && !ended;
	return rc;
}

int ledger_drop_submission(struct ledger *l, uint64_t id, struct error *e)
{
	struct ledger_job j;
	int rc = get_whole(l, id, &j, e);
	if (rc <= 0 || !(j.ended > 0) || !j.submission_size)
		return rc < 0 ? rc : 0;
	forget_submission(&j);
	return change(l, &j, e);
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
	int rc = get_existing(l, more->id, &j, e);
	if (rc)
		return rc;
	j.submission = more->submission;
	j.submission_size = more->submission_size;
	j.plan = more->plan;
	j.plan_size = more->plan_size;
	j.extended = more->extended;
	bool ended = j.ended > 0;
	j.ended = 0;
	j.state = "live";
	rc = change(l, &j, e);
	l->ended_count -= !rc && ended;
	return rc;
}

int ledger_ids(struct ledger *l, enum ledger_which which, uint64_t **ids, size_t *count, struct error *e)
{
	static const char *const sql[] = {[LEDGER_ALL] = "SELECT id FROM main.jobs ORDER BY id",
					  [LEDGER_LIVE] = "SELECT id FROM main.jobs WHERE ended IS NULL ORDER BY id"};
	sqlite3_stmt *s = NULL;
	int rc = sqlite3_prepare_v2(l->db, sql[which], -1, &s, NULL) == SQLITE_OK ? 0 : ledger_file_error(l->db, e),
	    step = SQLITE_DONE;
	*ids = NULL;
	*count = 0;
	while (!rc && (step = sqlite3_step(s)) == SQLITE_ROW) {
		uint64_t *more = list_room(*ids, *count, sizeof *more);
		if (more)
			(*ids = more)[(*count)++] = (uint64_t)sqlite3_column_int64(s, 0);
		else
			rc = error_set(e, ENOMEM, "no memory for the list of jobs");
	}
	if (!rc && step != SQLITE_DONE)
		rc = ledger_file_error(l->db, e);
	sqlite3_finalize(s);
	if (rc) {
		mem_free(*ids);
		*ids = NULL;
		*count = 0;
	}
	return rc;
}

int ledger_ended(struct ledger *l, enum ledger_from from, uint64_t id, uint64_t *ids, size_t most, size_t *count,
		 struct error *e)
{
	static const char *const sql[] = {
		[LEDGER_ABOVE] = "SELECT id FROM main.jobs WHERE id > ? AND ended IS NOT NULL ORDER BY id LIMIT ?",
		[LEDGER_BELOW] = "SELECT id FROM main.jobs WHERE id < ? AND ended IS NOT NULL ORDER BY id DESC LIMIT ?",
		[LEDGER_LAST] =
			"SELECT id FROM main.jobs WHERE id < ? AND ended IS NOT NULL ORDER BY ended DESC, id DESC LIMIT ?"};
	sqlite3_stmt *s = NULL;
	int rc = sqlite3_prepare_v2(l->db, sql[from], -1, &s, NULL) == SQLITE_OK ? 0 : ledger_file_error(l->db, e),
	    step = SQLITE_DONE;
	*count = 0;
	if (!rc) {
		sqlite3_bind_int64(s, 1, id < INT64_MAX ? (sqlite3_int64)id : INT64_MAX);
		sqlite3_bind_int64(s, 2, (sqlite3_int64)most);
	}
	while (!rc && (step = sqlite3_step(s)) == SQLITE_ROW && *count < most)
		ids[(*count)++] = (uint64_t)sqlite3_column_int64(s, 0);
	if (!rc && step != SQLITE_DONE)
		rc = ledger_file_error(l->db, e);
	sqlite3_finalize(s);
	return rc;
}

uint64_t ledger_ended_count(struct ledger *l)
{
	static const char sql[] = "SELECT count(*) FROM main.jobs WHERE ended IS NOT NULL";
	sqlite3_stmt *s = NULL;
	if (l->counted)
		return l->ended_count;
	if (sqlite3_prepare_v2(l->db, sql, -1, &s, NULL) == SQLITE_OK && sqlite3_step(s) == SQLITE_ROW) {
		l->ended_count = (uint64_t)sqlite3_column_int64(s, 0);
		l->counted = true;
	}
	sqlite3_finalize(s);
	return l->counted ? l->ended_count : 0;
}

int ledger_get(struct ledger *l, uint64_t id, struct ledger_job *j, struct error *e)
{
	return ledger_side_get(&l->jobs, id, j, e);
}

int ledger_write_record(struct ledger *l, const struct job_record *r, struct error *e)
{
	struct ledger_job j;
	int rc = get_existing(l, r->id, &j, e);
	return rc ? rc : change_record(l, &j, r, e);
}

int ledger_read_record(struct ledger *l, uint64_t id, struct job_record *r, struct error *e)
{
	double ended;
	return ledger_read_end(l, id, r, &ended, e);
}

int ledger_read_end(struct ledger *l, uint64_t id, struct job_record *r, double *ended, struct error *e)
{
	struct ledger_job j;
	int rc = get_whole(l, id, &j, e);
	if (rc < 0)
		return rc;
	if (!rc || !*j.record)
		return error_set(e, ENOENT, "there is no job j%llu", (unsigned long long)id);
	*ended = j.ended;
	rc = record_from_json(j.record, strlen(j.record), r, e);
	if (!rc && r->id != id)
		rc = error_set(e, EBADMSG, "the record of another job");
	return rc ? error_prefix(e, rc, "the record of j%llu", (unsigned long long)id) : 0;
}

int ledger_set(struct ledger *l, const char *name, const char *text, struct error *e)
{
	struct error fault;
	ledger_side_release(&l->jobs);
	int rc = ledger_side_set(&l->jobs, name, text, e);
	if (!rc && !l->behind && ledger_side_set(&l->copy, name, text, &fault))
		fall_behind(l, &fault);
	return rc;
}

int ledger_note(struct ledger *l, const char *name, char **text, struct error *e)
{
	return ledger_side_note(&l->jobs, name, text, e);
}
