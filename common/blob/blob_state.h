/* SPDX-License-Identifier: Apache-2.0 */
/* A store's state: blob.c has the folder and writing, blob_check.c reads what is there. What nobody holds is in a list,
 * in the order in which it was last used or released, so that evicting one looks at no others. */
#ifndef COMMON_BLOB_BLOB_STATE_H
#define COMMON_BLOB_BLOB_STATE_H

#include "common/blob/blob_hash.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/queue.h>

enum { BLOB_PATH_MOST = 4096 };

struct blob_entry {
	TAILQ_ENTRY(blob_entry) order; /* among the idle ones */
	struct blob_hash hash;
	uint64_t size;
	unsigned holds;
	unsigned checks; /* that have begun and not ended */
	double checked;	 /* when its contents were last verified, in s of a monotonic clock; 0: not since the start */
	bool given;	 /* opened since then */
	bool gone;	 /* or damaged: treated as missing, except for its holds */
};

struct blob_store {
	char *folder;
	uint64_t limit, bytes;
	TAILQ_HEAD(blob_order, blob_entry) idle; /* there and not held, the least recently used first */
	uint64_t idle_bytes;
	size_t evicted;		       /* entries that are left of those, until the next sweep */
	uint64_t arrived;	       /* of blobs that are being written */
	uint64_t temporary;	       /* number of the last temporary file */
	struct blob_entry **entries;   /* sorted by hash; there may be a million, and room is made between them */
	bool (*more_room)(void *user); /* NULL: nobody has any */
	void *user;
	size_t count, capacity;
	bool cache; /* see blob_store_use_as_cache */
};

/* All holds of an entry are taken and given back by these two. */
void blob_take(struct blob_store *s, struct blob_entry *n);
void blob_put(struct blob_store *s, struct blob_entry *n);
/* A new entry, or one that was used although nobody holds it, is the last to be evicted. */
void blob_idle_enter(struct blob_store *s, struct blob_entry *n);
void blob_idle_leave(struct blob_store *s, struct blob_entry *n);

#endif
