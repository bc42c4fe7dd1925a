/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The cache in which a worker keeps blobs between jobs and runs: a folder with a slot for each worker that runs on this
 * machine at the same time. Each slot is a blob store with its own lock. The loop's thread.
 */
#ifndef WORKER_DAEMON_CACHE_H
#define WORKER_DAEMON_CACHE_H

#include "common/blob/blob.h"
#include "worker/daemon/worker_identity.h"

struct cache {
	struct blob_store *blobs;
	const char *folder;		 /* as given to cache_open; not copied */
	int slot, lock_fd;		 /* number of the slot; descriptor of its locked file */
	struct worker_identity identity; /* of the slot */
};

/* Locks the first free slot and opens its store. folder NULL: $XDG_CACHE_HOME/hslt or ~/.cache/hslt. limit: most bytes
 * of the slot. Returns 0, -EPERM if the contents of the folder cannot be trusted, -EBUSY if there is no free slot, or
 * another -errno. */
int cache_open(struct cache *c, const char *folder, uint64_t limit, struct error *e);
/* Makes the slot's folder again if it has been removed, which users may do with ~/.cache at any time. Call before a
 * file is stored. */
int cache_restore_folder(struct cache *c, struct error *e);
void cache_close(struct cache *c);

#endif
