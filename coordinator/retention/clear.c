/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Clears finished jobs, by age and by space.
 *
 * A round starts every hour, and soon after a job has ended and its result was fetched. It reads the records of all
 * ended jobs, lets age.h choose, and clears the chosen jobs one by one. The work is divided into steps of one job;
 * clear_tick does as many as fit into 5 ms. A job is cleared in the order record, files, row, so that a client that
 * asks for its result meanwhile is told when it was deleted.
 *
 * A job that runs again, or whose result a client fetches, is skipped. If a record cannot be written, or memory for a
 * job runs out, the job waits for the next round. If the ledger cannot be read any further, the round goes on with
 * the jobs read so far, which are the older ones.
 */
#include "coordinator/retention/clear.h"

#include "common/base/clock.h"
#include "common/base/disk.h"
#include "common/base/list.h"
#include "common/base/mem.h"
#include "coordinator/retention/age.h"
#include "coordinator/retention/ages.h"
#include "coordinator/retention/keep.h"

#include <math.h>

static const double every_seconds = 3600, soon_seconds = 2, fresh_seconds = 60, tick_seconds = 0.005;
static const char *const results[] = {"result.exr", "preview.exr", "log"};
enum { RESULTS = sizeof results / sizeof *results };

enum { PIECE = 64 /* rows read or dropped at once */ };

/* A round in progress: it looks at all jobs, chooses among them, and clears the chosen ones. */
struct clearing {
	/* Ids of the jobs to look at next; in the last phase ids of the records to be dropped. */
	uint64_t ids[PIECE];
	size_t id_count, looked;
	uint64_t last;	  /* id of the job looked at last */
	struct list jobs; /* struct age_job: the ended jobs looked at */
	size_t cleared, records;
	double now; /* s since 1970, when the choice was made; 0: not yet */
	bool whole; /* all jobs have been looked at */
	bool again; /* the result of a job that ended just now is being fetched: start another round soon */
	struct job_record record; /* record of the current job */
};

/* Whether the job is live, or about to be: its films are being read for an extension. */
static bool is_needed(const struct jobs *jobs, uint64_t job)
{
	return jobs_find(jobs, job) || jobs_is_read(jobs, job);
}

static uint64_t result_bytes(const struct jobs *jobs, uint64_t job)
{
	uint64_t sum = 0;
	for (int i = 0; i < RESULTS; i++) {
		char path[SPOOL_PATH_MAX];
		struct stat st;
		spool_job_path(jobs->spool, job, results[i], path);
		sum += disk_stat(path, &st) == 0 ? (uint64_t)st.st_size : 0;
	}
	return sum;
}

static void clear_if_unneeded(const struct jobs *jobs, struct clearing *c, uint64_t id)
{
	double order;
	if (is_needed(jobs, id) || ledger_read_end(jobs->ledger, id, &c->record, &order, NULL) ||
	    !record_is_ended(&c->record))
		return;
	double now = ages_now(jobs);
	if (c->record.ended_seen < 0 || c->record.ended_seen > now) { /* its age is unknown and counts from now on */
		c->record.ended_seen = now;
		if (ledger_write_record(jobs->ledger, &c->record, NULL))
			return;
	}
	bool busy = jobs->peers.uses_result(jobs->peers.user, id);
	c->again |= busy && now - c->record.ended_seen < fresh_seconds;
	uint64_t films;
	struct age_job *j = keep_bytes(jobs, id, &films) ? list_push(&c->jobs) : NULL;
	if (!j) /* no memory, or its folder could not be read: the next round tries again */
		return;
	*j = (struct age_job){.id = id,
			      .order = order,
			      .ended = c->record.ended_seen,
			      .films = films,
			      .result = result_bytes(jobs, id),
			      .busy = busy};
}

/* Looks at the next job. Ids are read piece by piece, because reading a large table at once takes seconds. */
static void look_at_next(const struct jobs *jobs, struct clearing *c)
{
	struct error e;
	if (c->looked == c->id_count) {
		c->looked = 0;
		if (ledger_ended(jobs->ledger, LEDGER_ABOVE, c->last, c->ids, PIECE, &c->id_count, &e)) {
			log_event(LOG_SPOOL_FAULT, "text=%s", log_quote(e.text).text);
			c->id_count = 0; /* the jobs read so far are older than the missing ones */
		}
	}
	if (c->id_count == 0) {
		c->whole = true;
		return;
	}
	c->last = c->ids[c->looked++];
	clear_if_unneeded(jobs, c, c->last);
}

/* Drops many rows at once, because each change of the database is flushed. */
static void drop_rows(struct jobs *jobs, struct clearing *c)
{
	struct error e;
	if (c->records && ledger_drop(jobs->ledger, c->ids, c->records, &e))
		log_event(LOG_SPOOL_FAULT, "text=%s", log_quote(e.text).text);
	c->records = 0;
}

static void drop_result(struct jobs *jobs, const struct age_job *j, struct job_record *r, double now)
{
	struct error e;
	struct job_record *known = ended_jobs_find(jobs, j->id);
	if (r->has_result) {
		r->has_result = false;
		r->cleared = now;
		if (ledger_write_record(jobs->ledger, r,
					&e)) { /* keep the result until its record can say that it is deleted */
			log_event(LOG_SPOOL_FAULT, "job=j%llu text=%s", (unsigned long long)j->id,
				  log_quote(e.text).text);
			return;
		}
		if (known)
			*known = *r;
	}
	for (int i = 0; i < RESULTS; i++) {
		char path[SPOOL_PATH_MAX];
		spool_job_path(jobs->spool, j->id, results[i], path);
		disk_unlink(path);
	}
	log_event(LOG_JOB_CLEARED, "job=j%llu what=result bytes=%llu ended=%.0f", (unsigned long long)j->id,
		  (unsigned long long)j->result, r->ended);
}

/* Deletes the folder of a job whose record is to be dropped. Returns false if some of the folder is left. Without its
 * row the rest would look like a job that was lost, and the next start would be refused (reconcile.c), so the record
 * stays until the folder is gone. */
static bool drop_record(struct jobs *jobs, const struct age_job *j)
{
	struct error e;
	if (spool_drop_job(jobs->spool, j->id, &e)) {
		log_event(LOG_SPOOL_FAULT, "job=j%llu text=%s action=\"its record is kept\"", (unsigned long long)j->id,
			  log_quote(e.text).text);
		return false;
	}
	ended_jobs_remove(jobs, j->id);
	log_event(LOG_JOB_CLEARED, "job=j%llu what=record", (unsigned long long)j->id);
	return true;
}

/* Clears a chosen job, unless it has changed since. */
static void clear_job(struct jobs *jobs, struct clearing *c, const struct age_job *j)
{
	if ((!j->no_films || !j->films) && (!j->no_result || !j->result) && !j->no_record)
		return;
	if (is_needed(jobs, j->id) || jobs->peers.uses_result(jobs->peers.user, j->id) ||
	    ledger_read_record(jobs->ledger, j->id, &c->record, NULL) || c->record.ended_seen != j->ended)
		return;
	if (j->no_films && j->films) {
		keep_drop(jobs, j->id);
		log_event(LOG_JOB_CLEARED, "job=j%llu what=films bytes=%llu", (unsigned long long)j->id,
			  (unsigned long long)j->films);
	}
	if (j->no_result && j->result)
		drop_result(jobs, j, &c->record, c->now);
	if (j->no_record && drop_record(jobs, j)) {
		c->ids[c->records++] = j->id;
		if (c->records == PIECE)
			drop_rows(jobs, c);
	}
	jobs->changes++;
}

static void choose_jobs(const struct jobs *jobs, struct clearing *c)
{
	struct age_limits limits = {jobs->config.clear_seconds, jobs->config.clear_bytes};
	c->now = clock_wall_seconds();
	age_choose(c->jobs.items, c->jobs.count, &limits, ages_now(jobs));
}

/* Does one step of the round. Returns false if there is nothing left to do. */
static bool step(struct jobs *jobs, struct clearing *c)
{
	if (!c->whole)
		look_at_next(jobs, c);
	else if (!(c->now > 0))
		choose_jobs(jobs, c);
	else if (c->cleared < c->jobs.count)
		clear_job(jobs, c, (const struct age_job *)c->jobs.items + c->cleared++);
	else
		return false;
	return true;
}

void clear_close(struct jobs *jobs)
{
	struct clearing *c = jobs->clearing;
	if (!c)
		return;
	list_free(&c->jobs);
	mem_free(c);
	jobs->clearing = NULL;
}

static bool begin_round(struct jobs *jobs)
{
	struct clearing *c = jobs->clearing = mem_alloc(1, sizeof *c);
	if (c)
		c->jobs.size = sizeof(struct age_job);
	return c != NULL;
}

void clear_soon(struct jobs *jobs)
{
	jobs->clear_next = fmin(jobs->clear_next, jobs_now(jobs) + soon_seconds);
}

void clear_tick(struct jobs *jobs)
{
	double now = jobs_now(jobs);
	if (!jobs->clearing) {
		if (now < jobs->clear_next)
			return;
		jobs->clear_next = now + every_seconds;
		ages_keep(jobs);
		if ((!(jobs->config.clear_seconds > 0) && !jobs->config.clear_bytes) || !begin_round(jobs))
			return;
	}
	while (step(jobs, jobs->clearing))
		if (jobs_now(jobs) - now > tick_seconds)
			return;
	drop_rows(jobs, jobs->clearing);
	if (jobs->clearing->again)
		clear_soon(jobs);
	clear_close(jobs);
}
