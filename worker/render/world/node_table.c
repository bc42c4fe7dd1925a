/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/world/node_table.h"

#include <assert.h>
#include <errno.h>

int node_table_init(struct node_table *t, uint32_t capacity, struct arena *arena)
{
	size_t slot_count = 4;
	while (slot_count < 2 * (size_t)capacity)
		slot_count *= 2;
	*t = (struct node_table){arena_alloc(arena, slot_count, sizeof *t->entries), slot_count - 1, 0, capacity, 0};
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
static struct node_entry *find_slot(struct node_table *t, const void *node, const void *mesh)
{
	size_t i = (size_t)mix((uintptr_t)node + mix((uintptr_t)mesh + 1));
	for (;; i++) {
		struct node_entry *entry = &t->entries[i & t->mask];
		t->probe_count++;
		if (!entry->is_used || (entry->node == node && entry->mesh == mesh))
			return entry;
	}
}

bool node_table_find(struct node_table *t, const void *node, const void *mesh, uint32_t *number)
{
	const struct node_entry *entry = find_slot(t, node, mesh);
	*number = entry->number;
	return entry->is_used;
}

void node_table_add(struct node_table *t, const void *node, const void *mesh, uint32_t number)
{
	struct node_entry *entry = find_slot(t, node, mesh);
	assert(!entry->is_used && t->count < t->capacity);
	*entry = (struct node_entry){node, mesh, number, true};
	t->count++;
}
