#include "coordinator/shell/clear.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "coordinator/shell/keep.h"
#include "coordinator/shell/session.h"
#include "coordinator/store/age.h"

#include <math.h>
#include <string.h>
#include <time.h>

enum { JOBS_MOST = 1 << 17 };
static const double every_seconds = 3600, soon_seconds = 2, fetching_seconds = 60;
static const char *const results[] = {"result.exr", "preview.exr", "log"};
enum { RESULTS = sizeof results / sizeof *results };

static bool is_fetched(const struct server *s, uint64_t job)
{
	for (const struct session *p = s->sessions; p; p = p->next)
		if (p->watched == job || (p->fetching == job && server_now(s) - p->fetched < fetching_seconds)) /* or waits for it */
			return true;
	return false;
}

static uint64_t result_bytes(const struct server *s, uint64_t job)
{
	uint64_t sum = 0;
	for (int i = 0; i < RESULTS; i++) {
		char path[SPOOL_PATH_MAX];
		struct stat st;
		spool_job_path(s->spool, job, results[i], path);
		sum += disk_stat(path, &st) == 0 ? (uint64_t)st.st_size : 0;
	}
	return sum;
}

/* All that have ended, so far as their records can be read. */
static size_t list(const struct server *s, struct job_record *r, struct age_job **out)
{
	uint64_t *ids = mem_alloc(JOBS_MOST, sizeof *ids);
	size_t count = ids ? spool_jobs(s->spool, ids, JOBS_MOST) : 0, n = 0;
	struct age_job *jobs = count ? mem_alloc(count, sizeof *jobs) : NULL;
	for (size_t i = 0; jobs && i < count; i++) {
		if (server_order(s, ids[i]) || spool_read_record(s->spool, ids[i], r, NULL) || !record_is_ended(r))
			continue;
		jobs[n++] = (struct age_job){.id = ids[i], .ended = r->ended, .films = keep_bytes(s, ids[i]),
					     .result = result_bytes(s, ids[i]), .busy = is_fetched(s, ids[i])};
	}
	mem_free(ids);
	*out = jobs;
	return n;
}

static struct job_record *listed(struct server *s, uint64_t job)
{
	for (size_t i = 0; i < s->ended_count; i++)
		if (s->ended[i].id == job)
			return &s->ended[i];
	return NULL;
}

static void drop_result(struct server *s, const struct age_job *j, struct job_record *r, double now)
{
	struct error e;
	struct job_record *known = listed(s, j->id);
	if (spool_read_record(s->spool, j->id, r, &e))
		return;
	if (r->has_result) {
		r->has_result = false;
		r->cleared = now;
		if (spool_write_record(s->spool, r, &e)) { /* the result stays until its record can say that it is gone */
			log_event(LOG_SPOOL_FAULT, "job=j%llu text=%s", (unsigned long long)j->id, log_quote(e.text).text);
			return;
		}
		if (known)
			*known = *r;
	}
	for (int i = 0; i < RESULTS; i++) {
		char path[SPOOL_PATH_MAX];
		spool_job_path(s->spool, j->id, results[i], path);
		disk_unlink(path);
	}
	log_event(LOG_JOB_CLEARED, "job=j%llu what=result bytes=%llu ended=%.0f", (unsigned long long)j->id, (unsigned long long)j->result,
		  j->ended);
}

static void drop_record(struct server *s, const struct age_job *j)
{
	char path[SPOOL_PATH_MAX];
	struct job_record *known = listed(s, j->id);
	spool_job_path(s->spool, j->id, "job.json", path);
	disk_unlink(path);
	spool_job_path(s->spool, j->id, NULL, path);
	disk_rmdir(path);
	if (known) {
		size_t behind = s->ended_count - (size_t)(known - s->ended) - 1;
		memmove(known, known + 1, behind * sizeof *known);
		s->ended_count--;
	}
	log_event(LOG_JOB_CLEARED, "job=j%llu what=record", (unsigned long long)j->id);
}

void clear_run(struct server *s, double now)
{
	struct age_limits limits = {s->config.clear_seconds, s->config.clear_bytes};
	struct job_record *r = mem_alloc(1, sizeof *r);
	struct age_job *jobs = NULL;
	size_t count = r ? list(s, r, &jobs) : 0;
	age_choose(jobs, count, &limits, now);
	for (size_t i = 0; i < count; i++) {
		if (jobs[i].no_films && jobs[i].films) {
			keep_drop(s, jobs[i].id);
			log_event(LOG_JOB_CLEARED, "job=j%llu what=films bytes=%llu", (unsigned long long)jobs[i].id,
				  (unsigned long long)jobs[i].films);
		}
		if (jobs[i].no_result && jobs[i].result)
			drop_result(s, &jobs[i], r, now);
		if (jobs[i].no_record)
			drop_record(s, &jobs[i]);
	}
	s->changes++;
	mem_free(jobs);
	mem_free(r);
}

void clear_soon(struct server *s)
{
	s->clear_next = fmin(s->clear_next, server_now(s) + soon_seconds);
}

void clear_tick(struct server *s)
{
	struct timespec now;
	if (server_now(s) < s->clear_next)
		return;
	s->clear_next = server_now(s) + every_seconds;
	if (!(s->config.clear_seconds > 0) && !s->config.clear_bytes)
		return;
	clock_gettime(CLOCK_REALTIME, &now);
	clear_run(s, (double)now.tv_sec + (double)now.tv_nsec * 1e-9);
}
