/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A submission that has been checked and waits for the blobs that the spool lacks. When the last one has arrived, the
 * job is given to the core. Belongs to its session. The loop's thread.
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
	struct envelope submission; /* owned */
	struct plan plan;
	char epoch_rule[160]; /* what the length of its epochs was derived from; "": it was requested */
	struct blob_store *blobs;
	bool *is_held;		/* [files]: the file's blob is in the store and held */
	uint32_t *by_hash;	/* [files]: indices of the files, sorted by hash */
	bool *has_arrived;	/* [places in by_hash]: the blob has arrived, but may not be flushed yet */
	size_t looked_up_count; /* number of files that have been looked for in the store */
	bool is_lookup_pending; /* the other files are looked for in a later turn of the loop */
	size_t missing_count;	/* number of files looked for that are not held */
	struct blob_writer *writer;
	struct blob_hash writer_hash;
	uint64_t received_bytes; /* bytes of files received so far */
	struct {
		double begun_at; /* s of the loop's clock: when the submission arrived */
		/* s of the loop's clock: when enough new bytes had arrived last; INFINITY: none are expected yet. */
		double progress_at;
		uint64_t progress_bytes; /* `received_bytes` at that time */
	} pace;				 /* set and used by the session */
	struct blob_batch *batch;	 /* blobs that have arrived and wait for the next flush; NULL: none */
	struct upload_flush *flush;	 /* the running flush; NULL: none */
};

/* Checks a Submit and takes over its envelope. bandwidth: as in struct plan_request. Returns -EINVAL with a sentence
 * for the client. */
int upload_new(struct upload **out, struct envelope *submit, struct blob_store *blobs, double bandwidth,
	       struct error *e);
/* Returns the bytes of its files; several files with the same content count once. */
uint64_t upload_file_bytes(const struct upload *u);
/* Looks for the files in the store, some per call, since each costs two system calls. Returns -EAGAIN: call again in
 * another turn of the loop; -EINPROGRESS: a file is being read, call again when upload_file_checked has returned true;
 * 0: all files have been looked for; -EINVAL with a sentence. */
int upload_look_up_files(struct upload *u, struct jobs *jobs, struct error *e);
/* Whether files are left to be looked for. */
bool upload_is_looking_up(const struct upload *u);
/* A file has been read. Returns true if the upload was waiting for it. */
bool upload_file_checked(struct upload *u, const struct blob_hash *h, bool is_intact);
void upload_free(struct upload *u); /* releases the blobs that it holds */

/* Takes one chunk from the client. Returns 1 if a blob is complete, and waits for upload_flush; 0 if not; -EFBIG if
 * there is no room for it now, in which case the same call may succeed later. */
int upload_add_chunk(struct upload *u, const Farm__BlobChunk *c, const unsigned char *payload, size_t size,
		     struct error *e);
/* Lets the pool flush the blobs that have arrived, unless a flush is running already. Then calls `done`, unless the
 * upload has been freed meanwhile. What was flushed is no longer missing, but more may have arrived. */
typedef void (*upload_flush_callback)(void *user, int rc, const struct error *e);
int upload_flush(struct upload *u, uv_loop_t *loop, upload_flush_callback done, void *user, struct error *e);
/* Writes the hash of each missing blob once, ascending, and returns their number. hashes: room for missing_count. */
size_t upload_missing_hashes(const struct upload *u, struct blob_hash *hashes);

#endif
