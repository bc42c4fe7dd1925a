/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Files being fetched from the coordinator into the cache, each once, however many jobs want it: any of those still
 * present when a chunk arrives has it stored. A chunk answers one request; others are ignored. A file that no job wants
 * any more is kept until its chunk arrives or the connection ends. Loop's thread. At most FETCHES_MOST.
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
