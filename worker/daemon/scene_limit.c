/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A scene is in use while the worker has leases of its job, or a thread builds it or reads its files. Only scenes that
 * are not in use are dropped.
 *
 * While only one scene at a time may be in memory, the first job that gets a lease has the turn. Leases of other jobs
 * are refused. If another job waits, new leases of the job that has the turn are refused, too, after turn_seconds: then
 * its last lease ends, its scene is dropped, and the next job that is granted a lease has the turn. In this way no job
 * has to wait for the end of another. A scene whose threads have been told to stop has lost the turn: leases of the
 * next job are accepted, and the next scene is built when these threads have stopped.
 */
#include "worker/daemon/scene_limit.h"

#include "common/base/clock.h"
#include "common/base/log.h"
#include "worker/daemon/fetch.h"
#include "worker/daemon/crash_record.h"

void scene_limit_drop(struct agent *a, struct job_cache *cache)
{
	struct job_cache **link = &a->job_caches;
	while (*link != cache)
		link = &(*link)->next;
	*link = cache->next;
	job_cache_free(cache);
}

struct job_cache *scene_limit_find_waiting(const struct agent *a, const struct blob_hash *h)
{
	for (struct job_cache *cache = a->job_caches; cache; cache = cache->next)
		if (cache->state == JOB_CACHE_FETCHING && blob_hash_equal(&cache->wanted_file, h))
			return cache;
	return NULL;
}

/* Drops the fetches that no job wants. One that has been requested stays until the answer arrives, so that the answer
 * is recognised. */
static void drop_unwanted_fetches(struct agent *a)
{
	for (struct fetch *f = a->fetches, *next; f; f = next) {
		next = f->next;
		if (!f->is_requested && !scene_limit_find_waiting(a, &f->hash))
			fetch_drop(a, f);
	}
}

static bool is_in_use(const struct job_cache *cache)
{
	return cache->lease_count || cache->state == JOB_CACHE_BUILDING || cache->reading.check;
}

void scene_limit_drop_unused(struct agent *a)
{
	for (;;) {
		struct job_cache *oldest = NULL, *ended = NULL;
		unsigned idle = 0;
		for (struct job_cache *cache = a->job_caches; cache; cache = cache->next) {
			if (is_in_use(cache))
				continue;
			idle++;
			if (cache->has_ended || cache->state == JOB_CACHE_FAILED)
				ended = cache;
			if (!oldest || cache->last_used < oldest->last_used)
				oldest = cache;
		}
		if (ended)
			scene_limit_drop(a, ended);
		else if (idle > IDLE_WORLDS_MAX)
			scene_limit_drop(a, oldest);
		else
			break;
	}
	drop_unwanted_fetches(a);
}

/* Returns whether a scene is in use only by threads that have been told to stop, because its leases were revoked or its
 * job has ended. */
static bool is_ending(const struct agent *a, const struct job_cache *cache)
{
	for (const struct lease_task *l = a->leases; l; l = l->next)
		if (l->job_cache == cache && !l->is_unwanted)
			return false;
	return cache->lease_count && cache->state != JOB_CACHE_BUILDING && !cache->reading.check;
}

bool scene_limit_must_wait(const struct agent *a, const struct job_cache *cache)
{
	for (const struct job_cache *o = a->job_caches; o; o = o->next)
		if (o != cache && is_ending(a, o))
			return crash_record_is_memory_short(clock_seconds());
	return false;
}

/* Drops all unused scenes but one. Returns the job whose scene stays: the first of those in use, otherwise `next`,
 * which may be NULL. */
static struct job_cache *keep_one_scene(struct agent *a, struct job_cache *next)
{
	struct job_cache *kept = NULL;
	for (struct job_cache *cache = a->job_caches; cache; cache = cache->next)
		kept = is_in_use(cache) && !is_ending(a, cache) ? cache : kept;
	kept = kept ? kept : next;
	for (struct job_cache *cache = a->job_caches, *following; cache; cache = following) {
		following = cache->next;
		if (cache != kept && !is_in_use(cache))
			scene_limit_drop(a, cache);
	}
	drop_unwanted_fetches(a);
	return kept;
}

/* turn_seconds: how long a job keeps the turn while another one waits. A job of which no lease has been granted for
 * waiter_timeout_seconds no longer counts as waiting: it has ended, or other workers compute it. */
static const double turn_seconds = 300, waiter_timeout_seconds = 60;

/* Refuses a lease of a job that does not have the turn, and notes that the job waits. */
static int refuse_until_turn(struct agent *a, uint64_t job, double now, struct error *e)
{
	struct scene_turn *t = &a->scene_turn;
	if (!t->has_waiter)
		log_event(
			LOG_JOB_NOTE,
			"job=j%llu text=\"waits: memory ran short, so this worker holds one scene at a time, now that of j%llu\"",
			log_u64_arg(job), log_u64_arg(t->job));
	t->waiting_since = t->has_waiter ? t->waiting_since : now;
	t->has_waiter = true;
	t->last_refused_at = now;
	return error_set(e, EAGAIN, "memory ran short, so it holds one scene at a time, now that of j%llu",
			 log_u64_arg(t->job));
}

int scene_limit_admit(struct agent *a, uint64_t job, struct error *e)
{
	struct scene_turn *t = &a->scene_turn;
	double now = clock_seconds();
	if (!crash_record_is_memory_short(now))
		return 0;
	const struct job_cache *first = keep_one_scene(a, job_cache_find(a->job_caches, job));
	if (first && first->job != t->job)
		*t = (struct scene_turn){.job = first->job};
	if (first && first->job != job)
		return refuse_until_turn(a, job, now, e);
	if (t->job != job)
		*t = (struct scene_turn){.job = job};
	t->has_waiter = t->has_waiter && now - t->last_refused_at < waiter_timeout_seconds;
	if (t->has_waiter && now - t->waiting_since >= turn_seconds)
		return error_set(
			e, EAGAIN,
			"memory ran short, so it holds one scene at a time, and this one makes way for another job's");
	return 0;
}
