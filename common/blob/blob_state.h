/* SPDX-License-Identifier: Apache-2.0 */
/* A store's state: blob.c has the folder and writing, blob_check.c reads what is there. */
#ifndef COMMON_BLOB_BLOB_STATE_H
#define COMMON_BLOB_BLOB_STATE_H

#include "common/blob/blob_hash.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { BLOB_PATH_MOST = 4096 };

struct blob_entry {
	struct blob_hash hash;
	uint64_t size, used; /* used: a counter that increases with every use */
	unsigned holds;
	unsigned checks; /* that have begun and not ended */
	double checked;	 /* when its contents were last verified, in s of a monotonic clock; 0: not since the start */
	bool given;	 /* opened since then */
	bool gone;	 /* or damaged: treated as missing, except for its holds */
};

struct blob_store {
	char *folder;
	uint64_t limit, bytes, clock;
	uint64_t arrived;	       /* of blobs that are being written */
	uint64_t temporary;	       /* number of the last temporary file */
	struct blob_entry **entries;   /* sorted by hash; there may be a million, and room is made between them */
	bool (*more_room)(void *user); /* NULL: nobody has any */
	void *user;
	size_t count, capacity;
	bool cache; /* see blob_store_use_as_cache */
};

#endif
