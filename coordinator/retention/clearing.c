/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Clears finished jobs, by age and by space.
 *
 * A round starts every hour, and soon after a job has ended and its result was fetched. It reads the records of all
 * ended jobs, lets expiry.h choose, and clears the chosen jobs one by one. The work is divided into steps of one job;
 * clearing_tick does as many as fit into 5 ms. A job is cleared in the order record, files, row, so that a client that
 * asks for its result meanwhile is told when it was deleted.
 *
 * A job that runs again, or whose result a client fetches, is skipped. If a record cannot be written, or memory for a
 * job runs out, the job waits for the next round. If the ledger cannot be read any further, the round goes on with
 * the jobs read so far, which are the older ones.
 */
#include "coordinator/retention/clearing.h"

#include "common/base/clock.h"
#include "common/base/disk.h"
#include "common/base/list.h"
#include "common/base/mem.h"
#include "coordinator/retention/expiry.h"
#include "coordinator/retention/observed_time.h"
#include "coordinator/retention/kept_films.h"

#include <math.h>

static const double round_interval_seconds = 3600, soon_seconds = 2, fresh_seconds = 60, tick_seconds = 0.005;
static const char *const result_files[] = {"result.exr", "preview.exr", "log"};
enum { RESULT_FILES = sizeof result_files / sizeof *result_files };

enum { ROW_BATCH = 64 /* rows read or dropped at once */ };

/* A round in progress: it looks at all jobs, chooses among them, and clears the chosen ones. */
struct clearing {
	/* Ids of the jobs to look at next; in the last phase ids of the records to be dropped. */
	uint64_t ids[ROW_BATCH];
	size_t id_count, examined_count;
	uint64_t last_id;	/* id of the job examined last */
	struct list candidates; /* struct expiry_job: the ended jobs looked at */
	size_t cleared_count, record_count;
	double chosen_at; /* s since 1970, when the choice was made; 0: not yet */
	bool has_examined_all;
	bool must_repeat_soon; /* the result of a job that ended just now is being fetched: start another round soon */
	struct job_record record; /* record of the current job */
};

/* Whether the job is live, or about to be: its films are being read for an extension. */
static bool is_needed(const struct jobs *jobs, uint64_t job)
{
	return jobs_find_live(jobs, job) || jobs_is_reading(jobs, job);
}

static uint64_t result_bytes(const struct jobs *jobs, uint64_t job)
{
	uint64_t sum = 0;
	for (int i = 0; i < RESULT_FILES; i++) {
		char path[SPOOL_PATH_MAX];
		struct stat st;
		spool_job_path(jobs->spool, job, result_files[i], path);
		sum += disk_stat(path, &st) == 0 ? (uint64_t)st.st_size : 0;
	}
	return sum;
}

static void add_candidate(const struct jobs *jobs, struct clearing *c, uint64_t id)
{
	double order;
	if (is_needed(jobs, id) || ledger_read_end(jobs->ledger, id, &c->record, &order, NULL) ||
	    !record_is_ended(&c->record))
		return;
	double now = observed_time_now(jobs);
	if (c->record.ended_seen < 0 || c->record.ended_seen > now) { /* its age is unknown and counts from now on */
		c->record.ended_seen = now;
		if (ledger_write_record(jobs->ledger, &c->record, NULL))
			return;
	}
	bool is_in_use = jobs->peers.is_result_in_use(jobs->peers.user, id);
	c->must_repeat_soon |= is_in_use && now - c->record.ended_seen < fresh_seconds;
	uint64_t films;
	struct expiry_job *j = kept_films_get_bytes(jobs, id, &films) ? list_push(&c->candidates) : NULL;
	if (!j) /* no memory, or its folder could not be read: the next round tries again */
		return;
	*j = (struct expiry_job){.id = id,
				 .end_order = order,
				 .ended_at = c->record.ended_seen,
				 .film_bytes = films,
				 .result_bytes = result_bytes(jobs, id),
				 .is_in_use = is_in_use};
}

/* Looks at the next job. Ids are read piece by piece, because reading a large table at once takes seconds. */
static void examine_next(const struct jobs *jobs, struct clearing *c)
{
	struct error e;
	if (c->examined_count == c->id_count) {
		c->examined_count = 0;
		if (ledger_list_ended(jobs->ledger, LEDGER_ABOVE, c->last_id, c->ids, ROW_BATCH, &c->id_count, &e)) {
			log_event(LOG_SPOOL_FAULT, "text=%s", log_quote(e.text).text);
			c->id_count = 0; /* the jobs read so far are older than the missing ones */
		}
	}
	if (c->id_count == 0) {
		c->has_examined_all = true;
		return;
	}
	c->last_id = c->ids[c->examined_count++];
	add_candidate(jobs, c, c->last_id);
}

/* Drops many rows at once, because each change of the database is flushed. */
static void drop_rows(struct jobs *jobs, struct clearing *c)
{
	struct error e;
	if (c->record_count && ledger_delete_ended(jobs->ledger, c->ids, c->record_count, &e))
		log_event(LOG_SPOOL_FAULT, "text=%s", log_quote(e.text).text);
	c->record_count = 0;
}

static void drop_result(struct jobs *jobs, const struct expiry_job *j, struct job_record *r, double now)
{
	struct error e;
	struct job_record *listed = ended_jobs_find(jobs, j->id);
	if (r->has_result) {
		r->has_result = false;
		r->cleared = now;
		if (ledger_write_record(jobs->ledger, r,
					&e)) { /* keep the result until its record can say that it is deleted */
			log_event(LOG_SPOOL_FAULT, "job=j%llu text=%s", (unsigned long long)j->id,
				  log_quote(e.text).text);
			return;
		}
		if (listed)
			*listed = *r;
	}
	for (int i = 0; i < RESULT_FILES; i++) {
		char path[SPOOL_PATH_MAX];
		spool_job_path(jobs->spool, j->id, result_files[i], path);
		disk_unlink(path);
	}
	log_event(LOG_JOB_CLEARED, "job=j%llu what=result bytes=%llu ended=%.0f", (unsigned long long)j->id,
		  (unsigned long long)j->result_bytes, r->ended);
}

/* Deletes the folder of a job whose record is to be dropped. Returns false if some of the folder is left. Without its
 * row the rest would look like a job that was lost, and the next start would be refused (reconcile.c), so the record
 * stays until the folder is gone. */
static bool drop_record(struct jobs *jobs, const struct expiry_job *j)
{
	struct error e;
	if (spool_delete_job(jobs->spool, j->id, &e)) {
		log_event(LOG_SPOOL_FAULT, "job=j%llu text=%s action=\"its record is kept\"", (unsigned long long)j->id,
			  log_quote(e.text).text);
		return false;
	}
	ended_jobs_remove(jobs, j->id);
	log_event(LOG_JOB_CLEARED, "job=j%llu what=record", (unsigned long long)j->id);
	return true;
}

/* Clears a chosen job, unless it has changed since. */
static void clear_job(struct jobs *jobs, struct clearing *c, const struct expiry_job *j)
{
	if ((!j->must_drop_films || !j->film_bytes) && (!j->must_drop_result || !j->result_bytes) &&
	    !j->must_drop_record)
		return;
	if (is_needed(jobs, j->id) || jobs->peers.is_result_in_use(jobs->peers.user, j->id) ||
	    ledger_read_record(jobs->ledger, j->id, &c->record, NULL) || c->record.ended_seen != j->ended_at)
		return;
	if (j->must_drop_films && j->film_bytes) {
		kept_films_drop(jobs, j->id);
		log_event(LOG_JOB_CLEARED, "job=j%llu what=films bytes=%llu", (unsigned long long)j->id,
			  (unsigned long long)j->film_bytes);
	}
	if (j->must_drop_result && j->result_bytes)
		drop_result(jobs, j, &c->record, c->chosen_at);
	if (j->must_drop_record && drop_record(jobs, j)) {
		c->ids[c->record_count++] = j->id;
		if (c->record_count == ROW_BATCH)
			drop_rows(jobs, c);
	}
	jobs->change_count++;
}

static void choose_jobs(const struct jobs *jobs, struct clearing *c)
{
	struct expiry_limits limits = {jobs->config.retention_seconds, jobs->config.retention_bytes};
	c->chosen_at = clock_wall_seconds();
	expiry_choose_deletions(c->candidates.items, c->candidates.count, &limits, observed_time_now(jobs));
}

/* Does one step of the round. Returns false if there is nothing left to do. */
static bool clearing_step(struct jobs *jobs, struct clearing *c)
{
	if (!c->has_examined_all)
		examine_next(jobs, c);
	else if (!(c->chosen_at > 0))
		choose_jobs(jobs, c);
	else if (c->cleared_count < c->candidates.count)
		clear_job(jobs, c, (const struct expiry_job *)c->candidates.items + c->cleared_count++);
	else
		return false;
	return true;
}

void clearing_close(struct jobs *jobs)
{
	struct clearing *c = jobs->clearing;
	if (!c)
		return;
	list_fini(&c->candidates);
	mem_free(c);
	jobs->clearing = NULL;
}

static bool begin_round(struct jobs *jobs)
{
	struct clearing *c = jobs->clearing = mem_alloc(1, sizeof *c);
	if (c)
		c->candidates.item_size = sizeof(struct expiry_job);
	return c != NULL;
}

void clearing_schedule_soon(struct jobs *jobs)
{
	jobs->next_clearing_at = fmin(jobs->next_clearing_at, jobs_now(jobs) + soon_seconds);
}

void clearing_tick(struct jobs *jobs)
{
	double now = jobs_now(jobs);
	if (!jobs->clearing) {
		if (now < jobs->next_clearing_at)
			return;
		jobs->next_clearing_at = now + round_interval_seconds;
		observed_time_store(jobs);
		if ((!(jobs->config.retention_seconds > 0) && !jobs->config.retention_bytes) || !begin_round(jobs))
			return;
	}
	while (clearing_step(jobs, jobs->clearing))
		if (jobs_now(jobs) - now > tick_seconds)
			return;
	drop_rows(jobs, jobs->clearing);
	if (jobs->clearing->must_repeat_soon)
		clearing_schedule_soon(jobs);
	clearing_close(jobs);
}
