/* SPDX-License-Identifier: Apache-2.0 */
#include "common/net/receive_pool.h"

static bool has_capacity(const struct receive_pool *p, uint64_t bytes)
{
	return p->used_bytes == 0 || (p->used_bytes <= p->max_bytes && bytes <= p->max_bytes - p->used_bytes);
}

static void grant_bytes(struct receive_pool *p, struct receive_turn *t)
{
	p->used_bytes += t->bytes;
	t->is_granted = true;
}

/* Lets a turn wait in the current round or, if its owner already waits, in the round after the owner's last turn. */
static void enqueue_turn(struct receive_pool *p, struct receive_turn *t)
{
	struct receive_turn **link = &p->queue;
	t->round = p->queue ? p->queue->round : 0;
	for (const struct receive_turn *w = p->queue; w; w = w->next)
		if (w->owner == t->owner)
			t->round = w->round + 1;
	while (*link && (*link)->round <= t->round)
		link = &(*link)->next;
	t->is_waiting = true;
	t->next = *link;
	*link = t;
}

bool receive_pool_acquire(struct receive_pool *p, struct receive_turn *t, uint64_t bytes)
{
	t->bytes = bytes;
	if (!p->queue && has_capacity(p, bytes)) {
		grant_bytes(p, t);
		return true;
	}
	enqueue_turn(p, t);
	return false;
}

static void dequeue_turn(struct receive_pool *p, struct receive_turn *t)
{
	struct receive_turn **link = &p->queue;
	while (*link != t)
		link = &(*link)->next;
	*link = t->next;
	t->is_waiting = false;
}

void receive_pool_release(struct receive_pool *p, struct receive_turn *t)
{
	if (t->is_waiting)
		dequeue_turn(p, t);
	else if (t->is_granted)
		p->used_bytes -= t->bytes;
	t->is_granted = false;
	while (p->queue && has_capacity(p, p->queue->bytes)) {
		struct receive_turn *next = p->queue;
		dequeue_turn(p, next);
		grant_bytes(p, next);
		next->on_granted(next);
	}
}
