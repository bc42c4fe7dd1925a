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
 * succeeds, `is_copy_behind` is set, and nothing is written to the copy before ledger_repair_copy has compared the
 * files again.
 */
#include "coordinator/store/ledger.h"

#include "common/base/clock.h"
#include "common/base/list.h"
#include "common/base/log.h"
#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/store/ledger_file.h"
#include "coordinator/store/ledger_replica.h"
#include "coordinator/store/note.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PATH_SIZE = 4200, SQL_SIZE = 400, REPLICAS = 2 };

static const char *const file_names[REPLICAS] = {"jobs.db", "jobs-copy.db"}, *const schemas[REPLICAS] = {"main",
													 "copy"};
static const char next_id_note[] = "next-job";

struct ledger {
	sqlite3 *db;
	struct ledger_replica jobs, copy;
	uint64_t next_id; /* id of the next job */
	bool is_new;
	bool is_copy_behind;  /* changes are missing in the copy */
	bool has_ended_count; /* ended_count is valid */
	uint64_t ended_count;
	double last_end_time; /* latest end in all rows; 0: not read yet */
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

static void mark_copy_behind(struct ledger *l, const struct error *e)
{
	l->is_copy_behind = true;
	log_event(LOG_SPOOL_FAULT, "file=%s text=%s action=\"it will be tried again\"", file_names[1],
		  log_quote(e->text).text);
}

static void log_repair(const struct ledger_job *j, const char *description)
{
	log_event(LOG_SPOOL_FAULT, "job=j%llu text=\"its row in %s\"", (unsigned long long)j->id, description);
}

static int write_row(struct ledger_replica *s, const struct ledger_job *j, struct error *e)
{
	int rc = ledger_replica_bind(s, j, e);
	return rc ? rc : ledger_replica_put(s, e);
}

/* Makes both files contain the better of two versions of a row. a: the row in jobs.db, b: in the copy; at most one of
 * them is NULL. */
static int merge_row(struct ledger *l, const struct ledger_job *a, const struct ledger_job *b, struct error *e)
{
	bool use_a = a && !a->is_damaged, use_b = b && !b->is_damaged;
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
		int has_a = ledger_replica_get_next(&l->jobs, id, &a, e);
		int has_b = has_a < 0 ? 0 : ledger_replica_get_next(&l->copy, id, &b, e);
		rc = has_a < 0 ? has_a : has_b < 0 ? has_b : 0;
		if (rc || (!has_a && !has_b))
			break;
		id = !has_b || (has_a && a.id < b.id) ? a.id : b.id;
		rc = merge_row(l, has_a && a.id == id ? &a : NULL, has_b && b.id == id ? &b : NULL, e);
	}
	ledger_replica_release(&l->jobs);
	ledger_replica_release(&l->copy);
	return rc;
}

/* Deletes the notes in one file that have a worse checksum than in the other file (note_rank), so that merge_notes
 * restores them. */
static int delete_damaged_notes(struct ledger *l, int side, struct error *e)
{
	char sql[SQL_SIZE];
	text_print(sql, sizeof sql,
		   "DELETE FROM %s.notes AS n WHERE EXISTS (SELECT 1 FROM %s.notes AS o WHERE o.name = n.name"
		   " AND note_rank(o.name, o.text) > note_rank(n.name, n.text))",
		   schemas[side], schemas[!side]);
	int changes_before = sqlite3_total_changes(l->db), rc = ledger_file_run(l->db, sql, e);
	if (!rc && sqlite3_total_changes(l->db) > changes_before)
		log_event(LOG_SPOOL_FAULT, "text=\"notes in %s were damaged: restored from %s\"", file_names[side],
			  file_names[!side]);
	return rc;
}

static int merge_notes(struct ledger *l, const char *from, const char *to, struct error *e)
{
	char sql[SQL_SIZE];
	text_print(sql, sizeof sql,
		   "INSERT OR REPLACE INTO %s.notes SELECT * FROM %s.notes AS n WHERE NOT EXISTS"
		   " (SELECT 1 FROM %s.notes AS o WHERE o.name = n.name AND o.revision >= n.revision)",
		   to, from, to);
	return ledger_file_run(l->db, sql, e);
}

/* Brings the files to the same contents in one transaction. At the start it may write both, later, when the copy is
 * behind, only the copy. */
static int merge_files(struct ledger *l, struct error *e)
{
	ledger_replica_release(&l->jobs);
	int rc = ledger_file_run(l->db, "BEGIN", e);
	if (rc)
		return rc;
	rc = merge_rows(l, e);
	if (!rc && !l->is_copy_behind)
		rc = delete_damaged_notes(l, 0, e);
	if (!rc)
		rc = delete_damaged_notes(l, 1, e);
	if (!rc)
		rc = merge_notes(l, schemas[0], schemas[1], e);
	if (!rc && !l->is_copy_behind)
		rc = merge_notes(l, schemas[1], schemas[0], e);
	return end_transaction(l, rc, e);
}

int ledger_repair_copy(struct ledger *l, struct error *e)
{
	int rc = l->is_copy_behind ? merge_files(l, e) : 0;
	l->is_copy_behind = rc != 0;
	return rc;
}

/* Prepares a file. A damaged one is renamed and created anew; its contents then come from the other file. */
static int prepare_file(const char *path, int side, struct error *e)
{
	int rc = ledger_file_prepare(path, e);
	if (rc != -EBADMSG)
		return rc;
	log_event(LOG_SPOOL_FAULT, "text=%s action=\"it is kept as %s.damaged, and restored from %s\"",
		  log_quote(e->text).text, file_names[side], file_names[!side]);
	rc = ledger_file_rename_damaged(path, e);
	return rc ? rc : ledger_file_prepare(path, e);
}

static int open_files(struct ledger *l, const char *folder, struct error *e)
{
	char path[REPLICAS][PATH_SIZE];
	int rc = 0;
	for (int s = 0; !rc && s < REPLICAS; s++) {
		text_print(path[s], PATH_SIZE, "%s/%s", folder, file_names[s]);
		rc = prepare_file(path[s], s, e);
	}
	if (!rc)
		rc = ledger_file_open(path[0], &l->db, e);
	if (!rc)
		rc = ledger_file_attach(l->db, path[1], schemas[1], e);
	if (!rc)
		rc = note_register(l->db, e);
	if (!rc)
		rc = ledger_replica_open(&l->jobs, l->db, schemas[0], e);
	return rc ? rc : ledger_replica_open(&l->copy, l->db, schemas[1], e);
}

/* Makes sure that the next id is above this one. Returns false if it was already. */
static bool raise_next_id(struct ledger *l, uint64_t id)
{
	if (id < l->next_id || id >= UINT64_MAX / 2)
		return false;
	l->next_id = id + 1;
	return true;
}

/* Finds the next id, from its note and from the rows. */
static int find_next_id(struct ledger *l, struct error *e)
{
	char *text;
	uint64_t *ids;
	size_t count;
	l->next_id = 1;
	int rc = ledger_get_note(l, next_id_note, &text, e);
	l->is_new = rc == -ENOENT;
	if (!rc) {
		raise_next_id(l, strtoull(text, NULL, 10) - 1);
		mem_free(text);
	} else if (rc == -EBADMSG) {
		log_event(LOG_SPOOL_FAULT, "text=%s action=\"the next id is derived from the known jobs\"",
			  log_quote(e->text).text);
	} else if (rc != -ENOENT) {
		return rc;
	}
	rc = ledger_list_ids(l, LEDGER_ALL, &ids, &count, e);
	if (!rc && count) {
		raise_next_id(l, ids[count - 1]);
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
	int rc = open_files(l, folder, e);
	if (!rc)
		rc = merge_files(l, e);
	if (!rc)
		rc = find_next_id(l, e);
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
	ledger_replica_close(&l->jobs);
	ledger_replica_close(&l->copy);
	sqlite3_close(l->db);
	mem_free(l);
}

bool ledger_is_new(const struct ledger *l)
{
	return l->is_new;
}

static int write_both(struct ledger *l, const struct ledger_job *j, struct error *e)
{
	struct error fault;
	int rc = ledger_replica_bind(&l->jobs, j, e);
	int behind = l->is_copy_behind ? 0 : ledger_replica_bind(&l->copy, j, &fault);
	ledger_replica_release(&l->jobs); /* j's texts may have come from there */
	if (!rc)
		rc = ledger_replica_put(&l->jobs, e);
	if (!rc && !l->is_copy_behind && !behind)
		behind = ledger_replica_put(&l->copy, &fault);
	if (!rc && behind)
		mark_copy_behind(l, &fault);
	return rc;
}

static int write_change(struct ledger *l, struct ledger_job *j, struct error *e)
{
	j->revision++;
	return write_both(l, j, e);
}

static int get_undamaged(struct ledger *l, uint64_t id, struct ledger_job *j, struct error *e)
{
	int rc = ledger_replica_get(&l->jobs, id, j, e);
	return rc > 0 && j->is_damaged ? error_set(e, EBADMSG, "the database of jobs: the row of j%llu is damaged",
						   (unsigned long long)id)
				       : rc;
}

/* Like get_undamaged(), but returns 0, or -ENOENT if there is no such row. */
static int get_existing(struct ledger *l, uint64_t id, struct ledger_job *j, struct error *e)
{
	int rc = get_undamaged(l, id, j, e);
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
	rc = write_change(l, j, e);
	mem_free(record);
	return rc;
}

static void clear_submission(struct ledger_job *j)
{
	j->submission = j->plan = NULL;
	j->submission_size = j->plan_size = 0;
}

static int remove_rows(struct ledger *l, struct ledger_replica *s, const uint64_t *ids, size_t count, struct error *e)
{
	ledger_replica_release(&l->jobs);
	int rc = ledger_file_run(l->db, "BEGIN", e);
	for (size_t i = 0; !rc && i < count; i++)
		rc = ids[i] ? ledger_replica_remove(s, ids[i], e) : 0;
	return end_transaction(l, rc, e);
}

/* Deletes from the copy first: after a fault in between the rows still exist in jobs.db and are dropped later. */
static int remove_both(struct ledger *l, const uint64_t *ids, size_t count, struct error *e)
{
	int rc = remove_rows(l, &l->copy, ids, count, e);
	return rc ? rc : remove_rows(l, &l->jobs, ids, count, e);
}

uint64_t ledger_next_id(const struct ledger *l)
{
	return l->next_id;
}

int ledger_skip_ids(struct ledger *l, uint64_t id, struct error *e)
{
	char text[32];
	if (!raise_next_id(l, id))
		return 0;
	text_print(text, sizeof text, "%llu", (unsigned long long)l->next_id);
	return ledger_set_note(l, next_id_note, text, e);
}

/* Writes the row and the id after it in one transaction. */
static int add_row(struct ledger *l, struct ledger_replica *s, const struct ledger_job *j, struct error *e)
{
	char next[32];
	text_print(next, sizeof next, "%llu", (unsigned long long)l->next_id);
	int rc = ledger_file_run(l->db, "BEGIN", e);
	if (!rc)
		rc = ledger_replica_set_note(s, next_id_note, next, e);
	if (!rc)
		rc = write_row(s, j, e);
	return end_transaction(l, rc, e);
}

int ledger_add(struct ledger *l, const struct ledger_job *j, struct error *e)
{
	struct ledger_job live, existing;
	struct error fault;
	int rc = ledger_replica_get(&l->jobs, j->id, &existing, e);
	if (rc)
		return rc < 0 ? rc
			      : error_set(e, EEXIST, "the database of jobs has a j%llu", (unsigned long long)j->id);
	raise_next_id(l, j->id);
	live = *j;
	live.state = "live";
	live.end_time = 0;
	live.holder = "";
	ledger_replica_release(&l->jobs);
	rc = add_row(l, &l->jobs, &live, e);
	if (!rc && !l->is_copy_behind && add_row(l, &l->copy, &live, &fault))
		mark_copy_behind(l, &fault);
	return rc;
}

int ledger_write_row(struct ledger *l, const struct ledger_job *j, struct error *e)
{
	l->has_ended_count = false;
	return write_both(l, j, e);
}

int ledger_delete(struct ledger *l, uint64_t id, struct error *e)
{
	l->has_ended_count = false;
	return remove_both(l, &id, 1, e);
}

int ledger_delete_ended(struct ledger *l, uint64_t *ids, size_t count, struct error *e)
{
	uint64_t dropped = 0;
	for (size_t i = 0; i < count; i++) {
		struct ledger_job j;
		int rc = ledger_replica_get(&l->jobs, ids[i], &j, e);
		if (rc < 0)
			return rc;
		if (rc && !(j.end_time > 0))
			ids[i] = 0;
		dropped += rc && j.end_time > 0;
	}
	int rc = remove_both(l, ids, count, e);
	l->has_ended_count = l->has_ended_count && !rc;
	l->ended_count -= dropped;
	return rc;
}

/* Returns the time of the end of a job: now, but later than all earlier ends, even if a wrong clock was set back. */
static double next_end_time(struct ledger *l)
{
	static const char sql[] = "SELECT max(ended) FROM main.jobs";
	sqlite3_stmt *s = NULL;
	double now = clock_wall_seconds();
	if (l->last_end_time == 0 && sqlite3_prepare_v2(l->db, sql, -1, &s, NULL) == SQLITE_OK &&
	    sqlite3_step(s) == SQLITE_ROW)
		l->last_end_time = sqlite3_column_double(s, 0);
	sqlite3_finalize(s);
	return fmax(now, fmax(1, nextafter(l->last_end_time, INFINITY)));
}

int ledger_end_job(struct ledger *l, const struct job_record *r, bool extendable, struct error *e)
{
	struct ledger_job j;
	int rc = get_undamaged(l, r->id, &j, e);
	if (rc <= 0 || j.extended != r->extended)
		return rc < 0 ? rc : 0;
	bool ended = j.end_time > 0;
	j.end_time = next_end_time(l);
	j.state = r->state;
	j.holder = "";
	if (!extendable)
		clear_submission(&j);
	double end = j.end_time;
	rc = change_record(l, &j, r, e);
	l->last_end_time = rc ? l->last_end_time : end;
	l->ended_count += !rc && !ended;
	return rc;
}

int ledger_delete_submission(struct ledger *l, uint64_t id, struct error *e)
{
	struct ledger_job j;
	int rc = get_undamaged(l, id, &j, e);
	if (rc <= 0 || !(j.end_time > 0) || !j.submission_size)
		return rc < 0 ? rc : 0;
	clear_submission(&j);
	return write_change(l, &j, e);
}

int ledger_set_holder(struct ledger *l, uint64_t id, const char *holder, struct error *e)
{
	struct ledger_job j;
	int rc = get_undamaged(l, id, &j, e);
	j.holder = holder;
	return rc > 0 ? write_change(l, &j, e) : rc;
}

int ledger_set_priority(struct ledger *l, uint64_t id, int priority, struct error *e)
{
	struct ledger_job j;
	int rc = get_undamaged(l, id, &j, e);
	j.priority = priority;
	return rc > 0 ? write_change(l, &j, e) : rc;
}

int ledger_extend_job(struct ledger *l, const struct ledger_job *extension, struct error *e)
{
	struct ledger_job j;
	int rc = get_existing(l, extension->id, &j, e);
	if (rc)
		return rc;
	j.submission = extension->submission;
	j.submission_size = extension->submission_size;
	j.plan = extension->plan;
	j.plan_size = extension->plan_size;
	j.extended = extension->extended;
	bool ended = j.end_time > 0;
	j.end_time = 0;
	j.state = "live";
	rc = write_change(l, &j, e);
	l->ended_count -= !rc && ended;
	return rc;
}

int ledger_list_ids(struct ledger *l, enum ledger_selection selection, uint64_t **ids, size_t *count, struct error *e)
{
	static const char *const sql[] = {[LEDGER_ALL] = "SELECT id FROM main.jobs ORDER BY id",
					  [LEDGER_LIVE] = "SELECT id FROM main.jobs WHERE ended IS NULL ORDER BY id"};
	sqlite3_stmt *s = NULL;
	int rc = sqlite3_prepare_v2(l->db, sql[selection], -1, &s, NULL) == SQLITE_OK ? 0
										      : ledger_file_set_error(l->db, e),
	    step = SQLITE_DONE;
	*ids = NULL;
	*count = 0;
	while (!rc && (step = sqlite3_step(s)) == SQLITE_ROW) {
		uint64_t *grown = list_grow_array(*ids, *count, sizeof *grown);
		if (grown)
			(*ids = grown)[(*count)++] = (uint64_t)sqlite3_column_int64(s, 0);
		else
			rc = error_set(e, ENOMEM, "no memory for the list of jobs");
	}
	if (!rc && step != SQLITE_DONE)
		rc = ledger_file_set_error(l->db, e);
	sqlite3_finalize(s);
	if (rc) {
		mem_free(*ids);
		*ids = NULL;
		*count = 0;
	}
	return rc;
}

int ledger_list_ended(struct ledger *l, enum ledger_range range, uint64_t id, uint64_t *ids, size_t max_count,
		      size_t *count, struct error *e)
{
	static const char *const sql[] = {
		[LEDGER_ABOVE] = "SELECT id FROM main.jobs WHERE id > ? AND ended IS NOT NULL ORDER BY id LIMIT ?",
		[LEDGER_BELOW] = "SELECT id FROM main.jobs WHERE id < ? AND ended IS NOT NULL ORDER BY id DESC LIMIT ?",
		[LEDGER_LATEST] =
			"SELECT id FROM main.jobs WHERE id < ? AND ended IS NOT NULL ORDER BY ended DESC, id DESC LIMIT ?"};
	sqlite3_stmt *s = NULL;
	int rc = sqlite3_prepare_v2(l->db, sql[range], -1, &s, NULL) == SQLITE_OK ? 0 : ledger_file_set_error(l->db, e),
	    step = SQLITE_DONE;
	*count = 0;
	if (!rc) {
		sqlite3_bind_int64(s, 1, id < INT64_MAX ? (sqlite3_int64)id : INT64_MAX);
		sqlite3_bind_int64(s, 2, (sqlite3_int64)max_count);
	}
	while (!rc && (step = sqlite3_step(s)) == SQLITE_ROW && *count < max_count)
		ids[(*count)++] = (uint64_t)sqlite3_column_int64(s, 0);
	if (!rc && step != SQLITE_DONE)
		rc = ledger_file_set_error(l->db, e);
	sqlite3_finalize(s);
	return rc;
}

uint64_t ledger_ended_count(struct ledger *l)
{
	static const char sql[] = "SELECT count(*) FROM main.jobs WHERE ended IS NOT NULL";
	sqlite3_stmt *s = NULL;
	if (l->has_ended_count)
		return l->ended_count;
	if (sqlite3_prepare_v2(l->db, sql, -1, &s, NULL) == SQLITE_OK && sqlite3_step(s) == SQLITE_ROW) {
		l->ended_count = (uint64_t)sqlite3_column_int64(s, 0);
		l->has_ended_count = true;
	}
	sqlite3_finalize(s);
	return l->has_ended_count ? l->ended_count : 0;
}

int ledger_read_row(struct ledger *l, uint64_t id, struct ledger_job *j, struct error *e)
{
	return ledger_replica_get(&l->jobs, id, j, e);
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
	int rc = get_undamaged(l, id, &j, e);
	if (rc < 0)
		return rc;
	if (!rc || !*j.record)
		return error_set(e, ENOENT, "there is no job j%llu", (unsigned long long)id);
	*ended = j.end_time;
	rc = record_from_json(j.record, strlen(j.record), r, e);
	if (!rc && r->id != id)
		rc = error_set(e, EBADMSG, "the record of another job");
	return rc ? error_prefix(e, rc, "the record of j%llu", (unsigned long long)id) : 0;
}

int ledger_set_note(struct ledger *l, const char *name, const char *text, struct error *e)
{
	struct error fault;
	ledger_replica_release(&l->jobs);
	int rc = ledger_replica_set_note(&l->jobs, name, text, e);
	if (!rc && !l->is_copy_behind && ledger_replica_set_note(&l->copy, name, text, &fault))
		mark_copy_behind(l, &fault);
	return rc;
}

int ledger_get_note(struct ledger *l, const char *name, char **text, struct error *e)
{
	return ledger_replica_get_note(&l->jobs, name, text, e);
}
