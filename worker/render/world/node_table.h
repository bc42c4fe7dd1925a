/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A hash table that maps a node to the number of its BSDF, for all meshes or for one of them, or to the number
 * of its medium. It uses linear probing and is at most half full. Entries are never removed. One thread;
 * allocated in the given arena.
 */
#ifndef WORKER_RENDER_WORLD_NODE_TABLE_H
#define WORKER_RENDER_WORLD_NODE_TABLE_H

#include "common/base/arena.h"

#include <stdbool.h>
#include <stdint.h>

struct node_entry {
	/* The key. NULL is a valid node; mesh NULL: the entry applies to all meshes. */
	const void *node, *mesh;
	uint32_t number;
	bool is_used;
};

struct node_table {
	struct node_entry *entries;
	size_t mask, count, capacity;
	uint64_t probe_count; /* so far */
};

/* Makes a table for at most that many entries. Returns 0 or -ENOMEM. */
int node_table_init(struct node_table *t, uint32_t capacity, struct arena *arena);

/* Looks up a key. Returns false if it is not in the table. */
bool node_table_find(struct node_table *t, const void *node, const void *mesh, uint32_t *number);

/* Adds a key that is not in the table. */
void node_table_add(struct node_table *t, const void *node, const void *mesh, uint32_t number);

#endif
