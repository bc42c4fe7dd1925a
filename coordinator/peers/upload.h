/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A submission that is checked and waits for the blobs that the spool lacks. When the last one has arrived, the job is
 * given to the core. Belongs to its session. The loop's thread.
 */
#ifndef COORDINATOR_PEERS_UPLOAD_H
#define COORDINATOR_PEERS_UPLOAD_H

#include "common/blob/blob_batch.h"
#include "common/plan/plan.h"
#include "common/wire/envelope.h"
#include "coordinator/live_job/jobs.h"

#include <uv.h>

struct upload_flush;

struct upload {
	struct envelope submit; /* owned */
	struct plan plan;
	char rule[160]; /* what its epochs' length was derived from; "": it was requested */
	struct blob_store *blobs;
	bool *held;	      /* by file: its blob is in the store and held */
	uint32_t *by_hash;    /* the files, sorted by hash */
	bool *arrived;	      /* by place in by_hash: its blob has arrived, and may not be flushed yet */
	size_t looked;	      /* so many files have been looked for in the store */
	bool looks_later;     /* for the others, once others have had a turn */
	size_t missing_count; /* of these, not held */
	struct blob_writer *writer;
	struct blob_hash writing;
	uint64_t received; /* bytes of files */
	struct {
		double begun;	    /* s of the loop's clock: when its message came */
		double paced;	    /* and when it last had enough new bytes; INFINITY: none are expected yet */
		uint64_t bytes;	    /* `received` then */
	} pace;			    /* the session's */
	struct blob_batch *batch;   /* blobs that arrived and wait for the next flush; NULL: none */
	struct upload_flush *flush; /* is running; NULL: none */
};

/* Takes the envelope of a Submit. bandwidth: as in struct plan_request. -EINVAL with a sentence for the client. */
int upload_new(struct upload **u, struct envelope *submit, struct blob_store *blobs, double bandwidth, struct error *e);
uint64_t upload_bytes(const struct upload *u); /* of its files; several with the same content are stored once */
/* Then its files are looked for in the store, some at a time, each of which costs two calls of the system. -EAGAIN:
 * call it again in another turn of the loop. -EINPROGRESS: one is being read; it goes on after upload_file_read has
 * said true. Otherwise all are known: 0, or -EINVAL with a sentence. */
int upload_look(struct upload *u, struct jobs *jobs, struct error *e);
bool upload_is_looking(const struct upload *u);
bool upload_file_read(struct upload *u, const struct blob_hash *h, bool right);
void upload_free(struct upload *u); /* releases the blobs that it holds */

/* One chunk from the client. 1: a blob is complete, and waits for upload_flush. -EFBIG: there is no room for it now,
 * and the same call may succeed once there is. */
int upload_add(struct upload *u, const Farm__BlobChunk *c, const unsigned char *payload, size_t size, struct error *e);
/* The pool flushes what has arrived, unless it is doing so already. Then `done` is called, unless the upload was freed
 * meanwhile; what was flushed is no longer missing, but more may have arrived. */
typedef void (*upload_flushed)(void *user, int rc, const struct error *e);
int upload_flush(struct upload *u, uv_loop_t *loop, upload_flushed done, void *user, struct error *e);
/* Each missing hash once, ascending. Returns the number; hashes has room for missing_count. */
size_t upload_missing(const struct upload *u, struct blob_hash *hashes);

#endif
