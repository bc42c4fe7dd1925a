/* SPDX-License-Identifier: Apache-2.0 */
#include "common/net/send_pool.h"

void send_pool_note_progress(struct send_share *s, uint64_t now)
{
	if (!s->pool)
		return;
	uint64_t unsent = s->unsent_bytes(s);
	if (unsent < s->last_unsent_bytes)
		s->progress_ms = now;
	s->last_unsent_bytes = unsent;
}

/* Returns the share that must give way. There always is one when this is called: some share holds something, and some
 * share at least the average. */
static struct send_share *slowest_reader(const struct send_pool *p, uint64_t now)
{
	struct send_share *found = NULL;
	uint64_t count = 0;
	for (struct send_share *s = LIST_FIRST(&p->waiting_shares); s; s = LIST_NEXT(s, next)) {
		send_pool_note_progress(s, now);
		count++;
	}
	for (struct send_share *s = LIST_FIRST(&p->waiting_shares); s; s = LIST_NEXT(s, next)) {
		bool large = s->bytes >= p->used_bytes / count;
		bool slower = !found || s->progress_ms < found->progress_ms ||
			      (s->progress_ms == found->progress_ms && s->bytes > found->bytes);
		if (large && slower)
			found = s;
	}
	return found;
}

bool send_pool_add(struct send_share *s, uint64_t bytes, uint64_t now)
{
	struct send_pool *p = s->pool;
	if (!p)
		return true;
	while (p->used_bytes && (p->used_bytes > p->max_bytes || bytes > p->max_bytes - p->used_bytes)) {
		struct send_share *slowest = slowest_reader(p, now);
		send_pool_close_share(slowest);
		slowest->evict(slowest);
		if (slowest == s)
			return false;
	}
	if (!s->bytes) {
		s->progress_ms = now;
		s->last_unsent_bytes = s->unsent_bytes(s);
		LIST_INSERT_HEAD(&p->waiting_shares, s, next);
	}
	s->bytes += bytes;
	p->used_bytes += bytes;
	return true;
}

void send_pool_subtract(struct send_share *s, uint64_t bytes, uint64_t now)
{
	struct send_pool *p = s->pool;
	if (!p || !bytes)
		return;
	*(s->is_closing ? &p->closing_bytes : &p->used_bytes) -= bytes;
	s->bytes -= bytes;
	s->progress_ms = now;
	s->last_unsent_bytes = s->unsent_bytes(s);
	if (!s->bytes && !s->is_closing)
		LIST_REMOVE(s, next);
}

void send_pool_adjust(struct send_share *s, int64_t bytes)
{
	if (!s->pool)
		return;
	s->bytes += (uint64_t)bytes;
	*(s->is_closing ? &s->pool->closing_bytes : &s->pool->used_bytes) += (uint64_t)bytes;
}

void send_pool_close_share(struct send_share *s)
{
	struct send_pool *p = s->pool;
	if (!p || s->is_closing)
		return;
	s->is_closing = true;
	if (!s->bytes)
		return;
	LIST_REMOVE(s, next);
	p->used_bytes -= s->bytes;
	p->closing_bytes += s->bytes;
}
