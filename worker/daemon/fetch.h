/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Files on their way from the coordinator into the cache, each once, however many jobs want it: whoever of them is
 * still there when a piece comes has it written. A piece is an answer to one question; one that nobody asked for is
 * none. What is under way when the last job that wanted it has gone stays until its piece comes or the connection ends.
 * Loop's thread. At most FETCHES_MOST.
 */
#ifndef WORKER_DAEMON_FETCH_H
#define WORKER_DAEMON_FETCH_H

#include "common/blob/blob.h"
#include "common/wire/envelope.h"

enum { FETCHES_MOST = 512 /* as many questions as a coordinator lets wait */ };

struct agent;

struct fetch {
	struct fetch *next;
	struct blob_hash hash;
	struct blob_writer *writer; /* from the first piece on */
	bool asked;		    /* on this connection, and not answered */
};

enum fetch_end {
	FETCH_MORE,
	FETCH_WHOLE, /* in the cache, and held once */
	FETCH_FAILED,
	FETCH_UNSTORED, /* failed by this machine's fault: its disk is full, read-only, broken */
};

/* Asks for the next piece, unless somebody has. -ENOMEM, -ENOBUFS. */
int fetch_want(struct agent *a, const struct blob_hash *h, struct error *e);
/* What the piece is the answer for; NULL: nobody asked for it. */
struct fetch *fetch_answered(struct agent *a, const Farm__BlobChunk *c);
enum fetch_end fetch_add(struct fetch *f, struct blob_store *s, const Farm__BlobChunk *c, const unsigned char *payload,
			 size_t size, struct error *e);
void fetch_drop(struct agent *a, struct fetch *f);
/* A new connection: nothing has been asked for. */
void fetch_reconnected(struct agent *a);

#endif
