/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Maps a node to the number of its BSDF, for all meshes or for one of them, or of its medium: a hash table with linear
 * probing, at most half full. Nothing is removed. One thread; allocated in the given arena.
 */
#ifndef WORKER_RENDER_WORLD_NODE_TABLE_H
#define WORKER_RENDER_WORLD_NODE_TABLE_H

#include "common/base/arena.h"

#include <stdbool.h>
#include <stdint.h>

struct node_entry {
	const void *node, *mesh; /* the key; NULL is a valid node; mesh NULL: for all meshes */
	uint32_t number;
	bool used;
};

struct node_table {
	struct node_entry *entries;
	size_t mask, count, most;
	uint64_t compared; /* entries probed so far */
};

/* Makes a table for at most that many entries. 0 or -ENOMEM. */
int node_table_init(struct node_table *t, uint32_t most, struct arena *arena);

/* false: not found. */
bool node_table_find(struct node_table *t, const void *node, const void *mesh, uint32_t *number);

/* Adds one that is not in the table. */
void node_table_add(struct node_table *t, const void *node, const void *mesh, uint32_t number);

#endif
