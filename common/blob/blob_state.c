/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Keeps the list of idle blobs, those that may be evicted, in the order of eviction. An entry leaves the list with its
 * first hold and enters it again, as the most recently used one, with its last release. A blob whose file is missing is
 * not in the list. Nothing fails.
 */
#include "common/blob/blob_state.h"

void blob_idle_add(struct blob_store *s, struct blob_entry *n)
{
	TAILQ_INSERT_TAIL(&s->idle, n, order);
	s->idle_bytes += n->size;
}

void blob_idle_remove(struct blob_store *s, struct blob_entry *n)
{
	TAILQ_REMOVE(&s->idle, n, order);
	s->idle_bytes -= n->size;
}

void blob_entry_hold(struct blob_store *s, struct blob_entry *n)
{
	if (n->hold_count++ == 0 && !n->is_missing)
		blob_idle_remove(s, n);
}

void blob_entry_release(struct blob_store *s, struct blob_entry *n)
{
	if (--n->hold_count == 0 && !n->is_missing)
		blob_idle_add(s, n);
}
