/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/daemon/scenes_kept.h"

#include "worker/daemon/fetch.h"

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

struct job_cache *scenes_kept_one(struct agent *a, struct job_cache *next)
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
