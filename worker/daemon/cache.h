/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Where a worker keeps blobs between jobs and runs: a folder with a slot for each worker that runs on this machine at
 * the same time. Each slot is a blob store with its own lock. The loop's thread.
 */
#ifndef WORKER_DAEMON_CACHE_H
#define WORKER_DAEMON_CACHE_H

#include "common/blob/blob.h"
#include "worker/daemon/worker_identity.h"

struct cache {
	struct blob_store *blobs;
	const char *folder; /* as given */
	int slot, lock;
	struct worker_identity identity; /* of the slot */
};

/* folder NULL: $XDG_CACHE_HOME/hslt or ~/.cache/hslt. limit: bytes of one slot. */
int cache_open(struct cache *c, const char *folder, uint64_t limit, struct error *e); /* keeps `folder` */
/* Makes the slot's folder again if somebody removed it, as anybody may do with ~/.cache at any time. Call before a file
 * is stored. */
int cache_mend(struct cache *c, struct error *e);
void cache_close(struct cache *c);

#endif
