/* SPDX-License-Identifier: Apache-2.0 */
#include "common/net/send_pool.h"

void send_pool_look(struct send_share *s, uint64_t now)
{
	if (!s->pool)
		return;
	uint64_t left = s->left(s);
	if (left < s->seen)
		s->moved = now;
	s->seen = left;
}

/* Returns the share that must give way. There always is one when this is called: some share holds something, and some
 * share at least the average. */
static struct send_share *slowest_reader(const struct send_pool *p, uint64_t now)
{
	struct send_share *found = NULL;
	uint64_t count = 0;
	for (struct send_share *s = LIST_FIRST(&p->waiting); s; s = LIST_NEXT(s, next)) {
		send_pool_look(s, now);
		count++;
	}
	for (struct send_share *s = LIST_FIRST(&p->waiting); s; s = LIST_NEXT(s, next)) {
		bool large = s->bytes >= p->used / count;
		bool slower =
			!found || s->moved < found->moved || (s->moved == found->moved && s->bytes > found->bytes);
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
	while (p->used && (p->used > p->limit || bytes > p->limit - p->used)) {
		struct send_share *slowest = slowest_reader(p, now);
		send_pool_leave(slowest);
		slowest->give_way(slowest);
		if (slowest == s)
			return false;
	}
	if (!s->bytes) {
		s->moved = now;
		s->seen = s->left(s);
		LIST_INSERT_HEAD(&p->waiting, s, next);
	}
	s->bytes += bytes;
	p->used += bytes;
	return true;
}

void send_pool_sub(struct send_share *s, uint64_t bytes, uint64_t now)
{
	struct send_pool *p = s->pool;
	if (!p || !bytes)
		return;
	*(s->leaves ? &p->leaving : &p->used) -= bytes;
	s->bytes -= bytes;
	s->moved = now;
	s->seen = s->left(s);
	if (!s->bytes && !s->leaves)
		LIST_REMOVE(s, next);
}

void send_pool_adjust(struct send_share *s, int64_t bytes)
{
	if (!s->pool)
		return;
	s->bytes += (uint64_t)bytes;
	*(s->leaves ? &s->pool->leaving : &s->pool->used) += (uint64_t)bytes;
}

void send_pool_leave(struct send_share *s)
{
	struct send_pool *p = s->pool;
	if (!p || s->leaves)
		return;
	s->leaves = true;
	if (!s->bytes)
		return;
	LIST_REMOVE(s, next);
	p->used -= s->bytes;
	p->leaving += s->bytes;
}
