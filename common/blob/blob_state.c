/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Who may be evicted, and in which order: an entry leaves the list of idle ones with its first hold and enters it
 * again, as the most recently used, when its last hold is given back. One whose file is missing is in no list. No
 * failures.
 */
#include "common/blob/blob_state.h"

void blob_idle_enter(struct blob_store *s, struct blob_entry *n)
{
	TAILQ_INSERT_TAIL(&s->idle, n, order);
	s->idle_bytes += n->size;
}

void blob_idle_leave(struct blob_store *s, struct blob_entry *n)
{
	TAILQ_REMOVE(&s->idle, n, order);
	s->idle_bytes -= n->size;
}

void blob_take(struct blob_store *s, struct blob_entry *n)
{
	if (n->holds++ == 0 && !n->gone)
		blob_idle_leave(s, n);
}

void blob_put(struct blob_store *s, struct blob_entry *n)
{
	if (--n->holds == 0 && !n->gone)
		blob_idle_enter(s, n);
}
