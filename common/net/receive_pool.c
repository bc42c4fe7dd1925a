/* SPDX-License-Identifier: Apache-2.0 */
#include "common/net/receive_pool.h"

#include <stddef.h>

static bool fits(const struct receive_pool *p, uint64_t bytes)
{
	return p->used == 0 || (p->used <= p->limit && bytes <= p->limit - p->used);
}

static void grant(struct receive_pool *p, struct receive_turn *t)
{
	p->used += t->bytes;
	t->has = true;
}

bool receive_pool_take(struct receive_pool *p, struct receive_turn *t, uint64_t bytes)
{
	t->bytes = bytes;
	if (!p->first && fits(p, bytes)) {
		grant(p, t);
		return true;
	}
	t->waits = true;
	t->next = NULL;
	if (p->first)
		p->last->next = t;
	else
		p->first = t;
	p->last = t;
	return false;
}

static void leave(struct receive_pool *p, struct receive_turn *t)
{
	struct receive_turn **at = &p->first, *before = NULL;
	for (; *at != t; at = &(*at)->next)
		before = *at;
	*at = t->next;
	if (p->last == t)
		p->last = before;
	t->waits = false;
}

void receive_pool_give(struct receive_pool *p, struct receive_turn *t)
{
	if (t->waits)
		leave(p, t);
	else if (t->has)
		p->used -= t->bytes;
	t->has = false;
	while (p->first && fits(p, p->first->bytes)) {
		struct receive_turn *next = p->first;
		leave(p, next);
		grant(p, next);
		next->go(next);
	}
}
