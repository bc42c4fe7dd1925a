/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Files that are being fetched from the coordinator into the cache, at most FETCHES_MOST. A file is fetched once,
 * however many jobs want it: when a chunk arrives, one of the jobs that still want it stores it. Chunks that were not
 * requested are ignored. A file that no job wants any more stays listed until the chunk that was requested arrives or
 * the connection ends. The loop's thread.
 */
#ifndef WORKER_DAEMON_FETCH_H
#define WORKER_DAEMON_FETCH_H

#include "common/blob/blob.h"
#include "common/wire/envelope.h"

enum { FETCHES_MOST = 512 /* as many requests as a coordinator allows */ };

struct agent;

struct fetch {
	struct fetch *next;
	struct blob_hash hash;
	struct blob_writer *writer; /* from the first chunk on */
	bool asked;		    /* on this connection, and not answered yet */
};

enum fetch_end {
	FETCH_MORE,
	FETCH_WHOLE, /* in the cache, and held once */
	FETCH_FAILED,
	FETCH_UNSTORED, /* failed because of this machine: its disk is full, read-only or broken */
};

/* Requests the next chunk, unless that was done. -ENOMEM, -ENOBUFS. */
int fetch_want(struct agent *a, const struct blob_hash *h, struct error *e);
/* The fetch that the chunk belongs to; NULL: it was not requested. */
struct fetch *fetch_answered(struct agent *a, const Farm__BlobChunk *c);
enum fetch_end fetch_add(struct fetch *f, struct blob_store *s, const Farm__BlobChunk *c, const unsigned char *payload,
			 size_t size, struct error *e);
void fetch_drop(struct agent *a, struct fetch *f);
/* A new connection: nothing has been requested on it. */
void fetch_reconnected(struct agent *a);

#endif
