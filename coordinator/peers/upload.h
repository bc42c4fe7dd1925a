/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A submission that is on its way: checked, and waiting for the blobs that the spool misses. When the last one is there
 * the job is given to the core. Belongs to its session. The loop's thread.
 */
#ifndef COORDINATOR_PEERS_UPLOAD_H
#define COORDINATOR_PEERS_UPLOAD_H

#include "common/blob/blob.h"
#include "common/plan/plan.h"
#include "common/wire/envelope.h"

struct upload {
	struct envelope submit; /* owned */
	struct plan plan;
	char rule[160]; /* by which its epochs are so long; "": they were asked for */
	struct blob_store *blobs;
	bool *held;	      /* a file's blob is there and held */
	uint32_t *by_hash;    /* the files in the order of their hashes */
	size_t missing_count; /* files not held */
	struct blob_writer *writer;
	struct blob_hash writing;
};

/* Takes the envelope of a Submit. bandwidth: as in struct plan_request. -EINVAL with a sentence for the client. */
int upload_new(struct upload **u, struct envelope *submit, struct blob_store *blobs, double bandwidth, struct error *e);
void upload_free(struct upload *u); /* lets go of the blobs that it holds */

/* One chunk from the client. 1: a blob is complete. */
int upload_add(struct upload *u, const Farm__BlobChunk *c, const unsigned char *payload, size_t size, struct error *e);
/* Each missing hash once, ascending. Returns how many; hashes has room for missing_count. */
size_t upload_missing(const struct upload *u, struct blob_hash *hashes);

#endif
