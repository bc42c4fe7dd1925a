/* SPDX-License-Identifier: Apache-2.0 */
#include "common/net/receive_pool.h"

static bool has_room(const struct receive_pool *p, uint64_t bytes)
{
	return p->used == 0 || (p->used <= p->limit && bytes <= p->limit - p->used);
}

static void grant_bytes(struct receive_pool *p, struct receive_turn *t)
{
	p->used += t->bytes;
	t->has = true;
}

/* Lets a turn wait in the current round or, if its owner already waits, in the round after the owner's last turn. */
static void enter_line(struct receive_pool *p, struct receive_turn *t)
{
	struct receive_turn **at = &p->first;
	t->round = p->first ? p->first->round : 0;
	for (const struct receive_turn *w = p->first; w; w = w->next)
		if (w->owner == t->owner)
			t->round = w->round + 1;
	while (*at && (*at)->round <= t->round)
		at = &(*at)->next;
	t->waits = true;
	t->next = *at;
	*at = t;
}

bool receive_pool_take(struct receive_pool *p, struct receive_turn *t, uint64_t bytes)
{
	t->bytes = bytes;
	if (!p->first && has_room(p, bytes)) {
		grant_bytes(p, t);
		return true;
	}
	enter_line(p, t);
	return false;
}

static void leave_line(struct receive_pool *p, struct receive_turn *t)
{
	struct receive_turn **at = &p->first;
	while (*at != t)
		at = &(*at)->next;
	*at = t->next;
	t->waits = false;
}

void receive_pool_give(struct receive_pool *p, struct receive_turn *t)
{
	if (t->waits)
		leave_line(p, t);
	else if (t->has)
		p->used -= t->bytes;
	t->has = false;
	while (p->first && has_room(p, p->first->bytes)) {
		struct receive_turn *next = p->first;
		leave_line(p, next);
		grant_bytes(p, next);
		next->go(next);
	}
}
