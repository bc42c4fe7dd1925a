/* SPDX-License-Identifier: Apache-2.0 */
/* The state of a store, shared by blob.c (folder, writing), blob_batch.c and blob_check.c. Blobs that are not held are
 * in a list, in the order in which they were last used or released, so that evicting one need not search. */
#ifndef COMMON_BLOB_BLOB_STATE_H
#define COMMON_BLOB_BLOB_STATE_H

#include "common/blob/blob_hash.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/queue.h>

enum { BLOB_PATH_MAX = 4096 };

struct blob_entry {
	TAILQ_ENTRY(blob_entry) order; /* position in the list of idle blobs */
	struct blob_hash hash;
	uint64_t size; /* 0 while the blob is missing */
	unsigned hold_count;
	unsigned check_count; /* checks that have begun and not ended */
	double check_time; /* when the contents were last verified, s of the monotonic clock; 0: not since the start */
	bool was_opened_since_check; /* opened since then, so the file may have been changed */
	bool is_missing;	     /* the file does not exist or is damaged; holds are kept */
};

struct blob_store {
	char *folder;
	uint64_t max_bytes, bytes;		 /* most bytes (0: no limit), and bytes of all complete blobs */
	TAILQ_HEAD(blob_order, blob_entry) idle; /* present and not held, the least recently used first */
	uint64_t idle_bytes;
	size_t evicted_count;	   /* entries of evicted blobs since the last sweep */
	uint64_t partial_bytes;	   /* bytes received of blobs that are being written */
	uint64_t last_temp_number; /* number of the last temporary file */
	/* sorted by hash; pointers, since there may be a million and inserting moves them */
	struct blob_entry **entries;
	bool (*free_space)(void *user); /* see blob_store_set_full_handler; NULL: not set */
	void *user;
	size_t count, capacity; /* of the entries */
	bool is_cache;		/* see blob_store_use_as_cache */
};

/* Take and give back one hold of an entry. All holds go through these two. */
void blob_entry_hold(struct blob_store *s, struct blob_entry *n);
void blob_entry_release(struct blob_store *s, struct blob_entry *n);
/* Put an entry at the end of the list of idle blobs, which is evicted last, and remove it from the list. */
void blob_idle_add(struct blob_store *s, struct blob_entry *n);
void blob_idle_remove(struct blob_store *s, struct blob_entry *n);

#endif
