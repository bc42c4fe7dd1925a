/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/world/node_table.h"

#include <assert.h>
#include <errno.h>

int node_table_init(struct node_table *t, uint32_t most, struct arena *arena)
{
	size_t room = 4;
	while (room < 2 * (size_t)most)
		room *= 2;
	*t = (struct node_table){arena_alloc(arena, room, sizeof *t->entries), room - 1, 0, most, 0};
	return t->entries ? 0 : -ENOMEM;
}

/* The finalizer of SplitMix64, because addresses differ in few bits. */
static uint64_t mix(uint64_t x)
{
	x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9;
	x = (x ^ x >> 27) * 0x94d049bb133111eb;
	return x ^ x >> 31;
}

/* Returns the entry with that key, or the free entry where it belongs. */
static struct node_entry *place_of(struct node_table *t, const void *node, const void *mesh)
{
	size_t i = (size_t)mix((uintptr_t)node + mix((uintptr_t)mesh + 1));
	for (;; i++) {
		struct node_entry *at = &t->entries[i & t->mask];
		t->compared++;
		if (!at->used || (at->node == node && at->mesh == mesh))
			return at;
	}
}

bool node_table_find(struct node_table *t, const void *node, const void *mesh, uint32_t *number)
{
	const struct node_entry *at = place_of(t, node, mesh);
	*number = at->number;
	return at->used;
}

void node_table_add(struct node_table *t, const void *node, const void *mesh, uint32_t number)
{
	struct node_entry *at = place_of(t, node, mesh);
	assert(!at->used && t->count < t->most);
	*at = (struct node_entry){node, mesh, number, true};
	t->count++;
}
