/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/daemon/fetch.h"

#include "common/base/mem.h"
#include "worker/daemon/outgoing.h"

#include <string.h>

static uint64_t fetch_offset(const struct fetch *f)
{
	return f->writer ? blob_write_offset(f->writer) : 0;
}

static void request_chunk(struct agent *a, struct fetch *f)
{
	f->is_requested = true;
	send_message(a,
		     ENVELOPE(BLOB_GET, blob_get, .hash = {BLOB_HASH_SIZE, f->hash.bytes}, .offset = fetch_offset(f)));
}

int fetch_request(struct agent *a, const struct blob_hash *h, struct error *e)
{
	struct fetch *f = a->fetches;
	unsigned count = 0;
	for (; f && !blob_hash_equal(&f->hash, h); f = f->next)
		count++;
	if (!f) {
		if (count == CONCURRENT_FETCHES_MAX)
			return error_set(e, ENOBUFS, "%u chunks of files were requested, and none was received", count);
		f = mem_alloc(1, sizeof *f);
		if (!f)
			return error_set(e, ENOMEM, "no memory to fetch a file");
		f->hash = *h;
		f->next = a->fetches;
		a->fetches = f;
	}
	if (!f->is_requested)
		request_chunk(a, f);
	return 0;
}

struct fetch *fetch_match_chunk(struct agent *a, const Farm__BlobChunk *c)
{
	if (c->hash.len != BLOB_HASH_SIZE)
		return NULL;
	for (struct fetch *f = a->fetches; f; f = f->next) {
		if (memcmp(c->hash.data, f->hash.bytes, BLOB_HASH_SIZE) != 0)
			continue;
		if (!f->is_requested || c->offset != fetch_offset(f))
			return NULL;
		f->is_requested = false;
		return f;
	}
	return NULL;
}

/* Files beyond the limit and wrong bytes are failures of the fetch; any other error is one of this machine's disk. */
static enum fetch_outcome failure_outcome(int rc)
{
	return rc == -EFBIG || rc == -EMSGSIZE || rc == -EBADMSG ? FETCH_FAILED : FETCH_NOT_STORED;
}

enum fetch_outcome fetch_store_chunk(struct fetch *f, struct blob_store *s, const Farm__BlobChunk *c,
				     const unsigned char *payload, size_t size, struct error *e)
{
	int rc = 0;
	if (*c->error || (size == 0 && c->offset < c->size)) {
		error_set(e, EBADMSG, "the coordinator no longer has a file of the scene: %s",
			  *c->error ? c->error : "it ended too early");
		return FETCH_FAILED;
	}
	if (!f->writer)
		rc = blob_write_begin(&f->writer, s, &f->hash, c->size, e);
	if (!rc)
		rc = blob_write_append(f->writer, payload, size, e);
	if (rc)
		return failure_outcome(rc);
	if (fetch_offset(f) < c->size)
		return FETCH_MORE;
	rc = blob_write_commit(f->writer, e);
	f->writer = NULL;
	return rc ? failure_outcome(rc) : FETCH_COMPLETE;
}

void fetch_drop(struct agent *a, struct fetch *f)
{
	struct fetch **place = &a->fetches;
	while (*place != f)
		place = &(*place)->next;
	*place = f->next;
	if (f->writer)
		blob_write_abort(f->writer);
	mem_free(f);
}

void fetch_reset_requests(struct agent *a)
{
	for (struct fetch *f = a->fetches; f; f = f->next)
		f->is_requested = false;
}
