/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The files that are being fetched from the coordinator into the cache, at most CONCURRENT_FETCHES_MAX. A file is
 * fetched once, however many jobs want it, and each chunk is stored as long as any job still wants the file. A file
 * that no job wants any more stays listed until the requested chunk arrives or the connection ends. The loop's thread.
 */
#ifndef WORKER_DAEMON_FETCH_H
#define WORKER_DAEMON_FETCH_H

#include "common/blob/blob.h"
#include "common/wire/envelope.h"

enum { CONCURRENT_FETCHES_MAX = 512 /* as many requests as a coordinator allows */ };

struct agent;

struct fetch {
	struct fetch *next;
	struct blob_hash hash;
	struct blob_writer *writer; /* NULL before the first chunk */
	bool is_requested;	    /* a chunk has been requested on this connection and not arrived yet */
};

enum fetch_outcome {
	FETCH_MORE,	  /* more chunks are needed */
	FETCH_COMPLETE,	  /* the file is in the cache, and held once */
	FETCH_FAILED,	  /* the coordinator sent no file, or one that is wrong or exceeds the cache */
	FETCH_NOT_STORED, /* failed because of this machine: its disk is full, read-only or broken */
};

/* Requests the next chunk of a file, unless that has been done. Returns 0, -ENOMEM, or -ENOBUFS if too many files are
 * being fetched. */
int fetch_request(struct agent *a, const struct blob_hash *h, struct error *e);
/* Returns the fetch to which a chunk belongs, which is then no longer awaited; NULL if the chunk was not requested. */
struct fetch *fetch_match_chunk(struct agent *a, const Farm__BlobChunk *c);
/* Stores a chunk. */
enum fetch_outcome fetch_store_chunk(struct fetch *f, struct blob_store *s, const Farm__BlobChunk *c,
				     const unsigned char *payload, size_t size, struct error *e);
/* Removes a fetch from the list, with the part of the file that has been stored. */
void fetch_drop(struct agent *a, struct fetch *f);
/* Call on a new connection, on which nothing has been requested yet. */
void fetch_reset_requests(struct agent *a);

#endif
