/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/daemon/scenes_kept.h"

#include "common/base/clock.h"
#include "common/base/log.h"
#include "worker/daemon/fetch.h"
#include "worker/daemon/work.h"

void scenes_kept_drop(struct agent *a, struct job_cache *b)
{
	struct job_cache **at = &a->job_caches;
	while (*at != b)
		at = &(*at)->next;
	*at = b->next;
	job_cache_free(b);
}

struct job_cache *scenes_kept_who_wants(const struct agent *a, const struct blob_hash *h)
{
	for (struct job_cache *b = a->job_caches; b; b = b->next)
		if (b->state == JOB_CACHE_FETCHING && blob_hash_equal(&b->wanted, h))
			return b;
	return NULL;
}

/* A requested file is kept until it is answered, so that the answer is not taken for another's. */
static void tidy_fetches(struct agent *a)
{
	for (struct fetch *f = a->fetches, *next; f; f = next) {
		next = f->next;
		if (!f->asked && !scenes_kept_who_wants(a, &f->hash))
			fetch_drop(a, f);
	}
}

static bool is_in_use(const struct job_cache *b)
{
	return b->users || b->state == JOB_CACHE_BUILDING || b->reading.check;
}

void scenes_kept_tidy(struct agent *a)
{
	for (;;) {
		struct job_cache *oldest = NULL, *ended = NULL;
		unsigned idle = 0;
		for (struct job_cache *b = a->job_caches; b; b = b->next) {
			if (is_in_use(b))
				continue;
			idle++;
			if (b->ended || b->state == JOB_CACHE_FAILED)
				ended = b;
			if (!oldest || b->last_used < oldest->last_used)
				oldest = b;
		}
		if (ended)
			scenes_kept_drop(a, ended);
		else if (idle > WORLDS_KEPT)
			scenes_kept_drop(a, oldest);
		else
			break;
	}
	tidy_fetches(a);
}

/* The job that stays, of several in use the first; next: if none is in use; may be NULL. */
static struct job_cache *keep_one(struct agent *a, struct job_cache *next)
{
	struct job_cache *left = NULL;
	for (struct job_cache *b = a->job_caches; b; b = b->next)
		left = is_in_use(b) ? b : left;
	left = left ? left : next;
	for (struct job_cache *b = a->job_caches, *after; b; b = after) {
		after = b->next;
		if (b != left && !is_in_use(b))
			scenes_kept_drop(a, b);
	}
	tidy_fetches(a);
	return left;
}

/* How long a scene stays while others wait; what counts as waiting no more: that job has ended, or others compute it.
 */
static const double turn_seconds = 300, asked_seconds = 60;

static int wait_for(struct agent *a, uint64_t job, double now, struct error *e)
{
	struct turn *t = &a->turn;
	if (!t->waits)
		log_event(LOG_JOB_NOTE, "job=j%llu text=\"waits: memory was short, and the scene of j%llu is in it\"",
			  log_u64(job), log_u64(t->job));
	t->since = t->waits ? t->since : now;
	t->waits = true;
	t->asked = now;
	return error_set(e, EAGAIN, "memory was short, and the scene of j%llu is in it", log_u64(t->job));
}

int scenes_kept_admit(struct agent *a, uint64_t job, struct error *e)
{
	struct turn *t = &a->turn;
	double now = clock_seconds();
	if (!work_memory_was_short(now))
		return 0;
	const struct job_cache *first = keep_one(a, job_cache_find(a->job_caches, job));
	if (first && first->job != t->job)
		*t = (struct turn){.job = first->job};
	if (first && first->job != job)
		return wait_for(a, job, now, e);
	if (t->job != job)
		*t = (struct turn){.job = job};
	t->waits = t->waits && now - t->asked < asked_seconds;
	if (t->waits && now - t->since >= turn_seconds)
		return error_set(e, EAGAIN, "memory was short, and its scene makes way for that of a job that waits");
	return 0;
}
