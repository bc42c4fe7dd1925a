/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Which BSDF was made of a node, for all meshes or for one of them: a hash table with linear probing that never fills
 * by more than a half. Nothing is removed. One thread; lives in the arena given.
 */
#ifndef WORKER_RENDER_WORLD_NODE_TABLE_H
#define WORKER_RENDER_WORLD_NODE_TABLE_H

#include "common/base/arena.h"

#include <stdbool.h>
#include <stdint.h>

struct node_entry {
	const void *node, *mesh; /* of what, NULL included; mesh NULL: of all meshes */
	uint32_t bsdf;
	bool used;
};

struct node_table {
	struct node_entry *entries;
	size_t mask, count, most;
	uint64_t compared; /* entries that were looked at so far */
};

/* Of at most so many entries. 0 or -ENOMEM. */
int node_table_init(struct node_table *t, uint32_t most, struct arena *arena);

/* False: there is none. */
bool node_table_find(struct node_table *t, const void *node, const void *mesh, uint32_t *bsdf);

/* One that is not there. */
void node_table_add(struct node_table *t, const void *node, const void *mesh, uint32_t bsdf);

#endif
