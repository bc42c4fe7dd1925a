/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A submission on its way from its message to the core.
 *
 * upload_new checks it: names and texts, that paths stay inside the scene's folder, sizes against the limits, and the
 * plan. upload_look_up_files holds the files that the spool has, each after it has been read and found right. The
 * client is told the hashes of the missing files and sends these, each in order, and upload_add_chunk writes them. The
 * pool flushes files that have arrived while more arrive, since a scene may have thousands of small files. A flushed
 * file is stored under its hash and held. When none is missing any more, the job can be submitted.
 *
 * Errors are -EINVAL with a sentence for the client, including bytes with a wrong hash or out of order. upload_free
 * releases all files that are held.
 */
#include "coordinator/peers/upload.h"

#include "common/base/mem.h"
#include "common/plan/plan_text.h"
#include "coordinator/jobs/files.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FILES_MAX = 10000, EFFECTS_MAX = 64, NOTES_MAX = 1000, NAME_BYTES_MAX = 1024 };
enum { LOOKUPS_PER_TURN = 64 /* files looked for in one turn; about a millisecond, on a disk that answers at once */ };
/* Limit on the mutations or samples of a lease whose length was requested: some minutes of a thread in usual scenes,
 * an hour if each takes 30 us. Without a limit a mistyped --epoch could keep a farm from all other jobs for days. */
enum { LEASE_MUTATIONS_MAX = 1 << 27 };
static const uint64_t max_scene_bytes = 1ull << 34; /* 16 GiB */

struct upload_flush {
	uv_work_t work;
	struct upload *upload; /* NULL: it has been freed */
	struct blob_batch *batch;
	/* The batch of an upload that has been freed: blobs that have arrived since this flush began; NULL: none. */
	struct blob_batch *leftover_batch;
	upload_flush_callback on_done;
	void *user;
	int rc;
	struct error error;
};

/* Whether a name is a relative path without "..", so that a scene may refer to it and a worker may look it up. */
static bool is_valid_name(const char *name)
{
	if (!envelope_text_is_valid(name, NAME_BYTES_MAX) || !*name || *name == '/')
		return false;
	for (const char *part = name; part; part = strchr(part, '/')) {
		part += *part == '/';
		size_t n = strcspn(part, "/");
		if (n == 0 || (n == 1 && part[0] == '.') || (n == 2 && part[0] == '.' && part[1] == '.'))
			return false;
	}
	return true;
}

static int check_files(const Farm__Submit *m, struct error *e)
{
	uint64_t total = 0;
	bool scene = false;
	if (m->n_files == 0 || m->n_files > FILES_MAX)
		return error_set(e, EINVAL, "a scene has 1 to %d files, not %zu", FILES_MAX, m->n_files);
	for (size_t i = 0; i < m->n_files; i++) {
		const Farm__File *f = m->files[i];
		if (!is_valid_name(f->name) || f->hash.len != BLOB_HASH_SIZE)
			return error_set(e, EINVAL, "file %zu of the scene has no valid name or hash", i);
		if (f->size > max_scene_bytes - total)
			return error_set(e, EINVAL, "the scene's files are larger than %llu bytes",
					 (unsigned long long)max_scene_bytes);
		total += f->size;
		scene = scene || strcmp(f->name, m->scene) == 0;
	}
	return scene ? 0 : error_set(e, EINVAL, "the scene file is not among the scene's files");
}

static int compare_names(const void *x, const void *y)
{
	const Farm__File *const *a = x, *const *b = y;
	return strcmp((*a)->name, (*b)->name);
}

/* Returns -EINVAL if two files have the same name, which would be ambiguous. */
static int check_names(const Farm__Submit *m, struct error *e)
{
	Farm__File **sorted = mem_alloc(m->n_files, sizeof *sorted);
	int rc = 0;
	if (!sorted)
		return error_set(e, ENOMEM, "no memory for a submission");
	memcpy(sorted, m->files, m->n_files * sizeof *sorted);
	qsort(sorted, m->n_files, sizeof *sorted, compare_names);
	for (size_t i = 1; !rc && i < m->n_files; i++)
		if (compare_names(&sorted[i - 1], &sorted[i]) == 0)
			rc = error_set(e, EINVAL, "%.256s: the scene has two files of that name", sorted[i]->name);
	mem_free(sorted);
	return rc;
}

static int check_text(const char *text, int max_bytes, const char *option, struct error *e)
{
	return envelope_text_is_valid(text, (size_t)max_bytes)
		       ? 0
		       : error_set(e, EINVAL, "%s: at most %d bytes of UTF-8 without control characters", option,
				   max_bytes);
}

static int check_defines(const Farm__Submit *m, struct error *e)
{
	int rc = m->n_defines <= PLAN_DEFINES_MAX
			 ? 0
			 : error_set(e, EINVAL, "-D: at most %d, not %zu", PLAN_DEFINES_MAX, m->n_defines);
	for (size_t i = 0; !rc && i < m->n_defines; i++) {
		rc = check_text(m->defines[i]->name, 256, "the name of -D NAME=VALUE", e);
		if (!rc)
			rc = check_text(m->defines[i]->value, 4096, "the value of -D NAME=VALUE", e);
	}
	return rc;
}

static int check_paths(const Farm__Submit *m, struct error *e)
{
	int rc = m->n_paths <= PLAN_PATHS_MAX
			 ? 0
			 : error_set(e, EINVAL, "--path: at most %d, not %zu", PLAN_PATHS_MAX, m->n_paths);
	for (size_t i = 0; !rc && i < m->n_paths; i++)
		rc = check_text(m->paths[i], 4096, "--path", e);
	return rc;
}

/* Checks effects and notes, which the client has derived from the scene. */
static int check_notes(const Farm__Submit *m, struct error *e)
{
	bool ok = m->n_effects <= EFFECTS_MAX && m->n_notes <= NOTES_MAX;
	for (size_t i = 0; ok && i < m->n_effects; i++)
		ok = envelope_text_is_valid(m->effects[i]->name, 64) &&
		     envelope_text_is_valid(m->effects[i]->why, 256) &&
		     envelope_text_is_valid(m->effects[i]->saves, 256);
	for (size_t i = 0; ok && i < m->n_notes; i++)
		ok = envelope_text_is_valid(m->notes[i], 2048);
	return ok ? 0
		  : error_set(e, EINVAL, "the scene has more than %d effects or %d notes, or one is too long",
			      EFFECTS_MAX, NOTES_MAX);
}

static int check_texts(const Farm__Submit *m, struct error *e)
{
	int rc = check_text(m->name, 127, "--name", e);
	if (!rc)
		rc = check_text(m->scene, NAME_BYTES_MAX, "the scene's file name", e);
	if (!rc)
		rc = check_text(m->output, 1023, "-o", e);
	if (!rc)
		rc = check_text(m->camera, 1023, "--camera", e);
	if (!rc)
		rc = check_defines(m, e);
	if (!rc)
		rc = check_paths(m, e);
	return rc ? rc : check_notes(m, e);
}

static int check_submission(const Farm__Submit *m, double bandwidth, struct plan *plan, char *rule, size_t rule_size,
			    struct error *e)
{
	struct plan_request request;
	int rc = check_texts(m, e);
	if (!rc)
		rc = check_files(m, e);
	if (!rc)
		rc = check_names(m, e);
	if (!rc && (m->render_width > PLAN_SIDE_MAX || m->render_height > PLAN_SIDE_MAX))
		rc = error_set(e, EINVAL, "a film of %ux%u", m->render_width, m->render_height);
	if (!rc && !(m->brightest >= 0 && isfinite(m->brightest)))
		rc = error_set(e, EINVAL, "a brightness of %g", m->brightest);
	if (!rc && !(m->verify >= 0 && m->verify <= 1))
		rc = error_set(e, EINVAL, "a share of %g of the epochs to be verified", m->verify);
	if (!rc && m->verify > 0 && m->mixed)
		rc = error_set(e, EINVAL,
			       "results of different fingerprints cannot be compared: verify or mixed, not both");
	if (!rc)
		rc = plan_request_from_wire(m->plan, &request, e);
	if (rc)
		return rc;
	request.bandwidth = bandwidth;
	rc = plan_make(&request, plan, e);
	if (!rc && request.epoch && plan_lease_mutations(plan) > LEASE_MUTATIONS_MAX)
		rc = error_set(
			e, EINVAL,
			"an epoch of %llu makes leases of %llu mutations or samples, each of which keeps a thread from "
			"all other jobs; at most %d are allowed: use a shorter --epoch, or more --parts",
			(unsigned long long)request.epoch, (unsigned long long)plan_lease_mutations(plan),
			LEASE_MUTATIONS_MAX);
	if (!rc)
		plan_describe_epoch(&request, plan, rule, rule_size);
	return rc;
}

static int compare_hashes(const void *x, const void *y, void *files)
{
	Farm__File *const *f = files;
	return memcmp(f[*(const uint32_t *)x]->hash.data, f[*(const uint32_t *)y]->hash.data, BLOB_HASH_SIZE);
}

/* Sorts the files by hash, once: there may be thousands, and each is looked up when it arrives. */
static int sort_hashes(struct upload *u, struct error *e)
{
	const Farm__Submit *m = u->submission.message->submit;
	for (uint32_t i = 0; i < m->n_files; i++)
		u->by_hash[i] = i;
	qsort_r(u->by_hash, m->n_files, sizeof *u->by_hash, compare_hashes, m->files);
	for (size_t i = 1; i < m->n_files; i++) {
		const Farm__File *a = m->files[u->by_hash[i - 1]], *b = m->files[u->by_hash[i]];
		if (memcmp(a->hash.data, b->hash.data, BLOB_HASH_SIZE) == 0 && a->size != b->size)
			return error_set(e, EINVAL, "%.256s: the same content as %.256s, but another size", a->name,
					 b->name);
	}
	return 0;
}

uint64_t upload_file_bytes(const struct upload *u)
{
	const Farm__Submit *m = u->submission.message->submit;
	uint64_t bytes = 0;
	for (size_t i = 0; i < m->n_files; i++) {
		const Farm__File *f = m->files[u->by_hash[i]], *before = i ? m->files[u->by_hash[i - 1]] : NULL;
		bytes += before && memcmp(f->hash.data, before->hash.data, BLOB_HASH_SIZE) == 0 ? 0 : f->size;
	}
	return bytes;
}

/* Returns the index of the first entry of by_hash that is not below h. */
static size_t lower_bound(const struct upload *u, const struct blob_hash *h)
{
	const Farm__Submit *m = u->submission.message->submit;
	size_t low = 0, high = m->n_files;
	while (low < high) {
		size_t middle = low + (high - low) / 2;
		if (memcmp(m->files[u->by_hash[middle]]->hash.data, h->bytes, BLOB_HASH_SIZE) < 0)
			low = middle + 1;
		else
			high = middle;
	}
	return low;
}

/* A blob has been stored: holds it for every file with that content. */
static void hold_blob(struct upload *u, const struct blob_hash *h)
{
	const Farm__Submit *m = u->submission.message->submit;
	for (size_t at = lower_bound(u, h); at < m->n_files; at++) {
		uint32_t i = u->by_hash[at];
		if (memcmp(m->files[i]->hash.data, h->bytes, BLOB_HASH_SIZE) != 0)
			break;
		if (!u->is_held[i])
			u->missing_count -= u->is_held[i] = blob_hold(u->blobs, h);
	}
}

/* Notes whether the next file to be looked for is in the store and right. */
static void note_lookup(struct upload *u, const struct blob_hash *h, bool is_intact)
{
	u->is_held[u->looked_up_count] = is_intact && blob_hold(u->blobs, h);
	u->missing_count += !u->is_held[u->looked_up_count++];
}

/* Checks the sizes in the submission: one that differs from its blob's would mislead workers. */
static int check_sizes(const struct upload *u, struct error *e)
{
	const Farm__Submit *m = u->submission.message->submit;
	for (size_t i = 0; i < m->n_files; i++) {
		struct blob_hash h = file_hash_from_wire(m->files[i]);
		uint64_t size;
		if (u->is_held[i] && (!blob_is_stored(u->blobs, &h, &size) || size != m->files[i]->size))
			return error_set(e, EINVAL, "%s: its size does not match its content", m->files[i]->name);
	}
	return 0;
}

int upload_new(struct upload **out, struct envelope *submit, struct blob_store *blobs, double bandwidth,
	       struct error *e)
{
	const Farm__Submit *m = submit->message->submit;
	struct upload *u = mem_alloc(1, sizeof *u);
	if (!u)
		return error_set(e, ENOMEM, "no memory for a submission");
	int rc = check_submission(m, bandwidth, &u->plan, u->epoch_rule, sizeof u->epoch_rule, e);
	if (!rc) {
		u->is_held = mem_alloc(m->n_files, sizeof *u->is_held);
		u->has_arrived = mem_alloc(m->n_files, sizeof *u->has_arrived);
		u->by_hash = mem_alloc(m->n_files, sizeof *u->by_hash);
		if (!u->is_held || !u->has_arrived || !u->by_hash)
			rc = error_set(e, ENOMEM, "no memory for a submission");
	}
	if (rc) {
		upload_free(u);
		return rc;
	}
	u->blobs = blobs;
	u->submission = *submit;
	memset(submit, 0, sizeof *submit);
	rc = sort_hashes(u, e);
	if (rc)
		upload_free(u);
	else
		*out = u;
	return rc;
}

bool upload_is_looking_up(const struct upload *u)
{
	return u->looked_up_count < u->submission.message->submit->n_files;
}

int upload_look_up_files(struct upload *u, struct jobs *jobs, struct error *e)
{
	const Farm__Submit *m = u->submission.message->submit;
	u->is_lookup_pending = false;
	for (int i = 0; upload_is_looking_up(u); i++) {
		if (i == LOOKUPS_PER_TURN) {
			u->is_lookup_pending = true;
			return -EAGAIN;
		}
		struct blob_hash h = file_hash_from_wire(m->files[u->looked_up_count]);
		int rc = blob_is_stored(u->blobs, &h, NULL) ? files_check(jobs, &h, NULL) : -ENOENT;
		if (rc == -EINPROGRESS)
			return rc;
		note_lookup(u, &h, rc == 0);
	}
	return check_sizes(u, e);
}

bool upload_file_checked(struct upload *u, const struct blob_hash *h, bool is_intact)
{
	if (!upload_is_looking_up(u))
		return false;
	struct blob_hash next = file_hash_from_wire(u->submission.message->submit->files[u->looked_up_count]);
	if (!blob_hash_equal(&next, h))
		return false;
	note_lookup(u, h, is_intact);
	return true;
}

void upload_free(struct upload *u)
{
	if (u->writer)
		blob_write_abort(u->writer);
	if (u->flush) {
		u->flush->upload = NULL;
		u->flush->leftover_batch = u->batch;
		/* Stops the flush early, since others wait for a thread of the pool. */
		blob_batch_cancel(u->flush->batch);
	} else {
		blob_batch_free(u->batch);
	}
	const Farm__Submit *m = u->submission.message ? u->submission.message->submit : NULL;
	for (size_t i = 0; m && i < m->n_files; i++) {
		struct blob_hash h = file_hash_from_wire(m->files[i]);
		if (u->is_held[i])
			blob_release(u->blobs, &h);
	}
	envelope_fini(&u->submission);
	mem_free(u->is_held);
	mem_free(u->has_arrived);
	mem_free(u->by_hash);
	mem_free(u);
}

static const Farm__File *find_missing_file(const struct upload *u, const struct blob_hash *h)
{
	const Farm__Submit *m = u->submission.message->submit;
	size_t at = lower_bound(u, h);
	const Farm__File *f = at < m->n_files ? m->files[u->by_hash[at]] : NULL;
	return f && !u->is_held[u->by_hash[at]] && !u->has_arrived[at] &&
			       memcmp(f->hash.data, h->bytes, BLOB_HASH_SIZE) == 0
		       ? f
		       : NULL;
}

/* Adds the blob of the writer, which is complete, to the batch. */
static int add_to_batch(struct upload *u, struct error *e)
{
	struct blob_writer *w = u->writer;
	if (!u->batch && !(u->batch = blob_batch_new(u->blobs)))
		return error_set(e, ENOMEM, "no memory for a submission");
	u->writer = NULL;
	int rc = blob_batch_add(u->batch, w, e);
	if (!rc)
		u->has_arrived[lower_bound(u, &u->writer_hash)] = true;
	return rc;
}

int upload_add_chunk(struct upload *u, const Farm__BlobChunk *c, const unsigned char *payload, size_t size,
		     struct error *e)
{
	struct blob_hash h;
	int rc = 0;
	if (c->hash.len != BLOB_HASH_SIZE)
		return error_set(e, EINVAL, "a blob's name has %zu bytes", c->hash.len);
	memcpy(h.bytes, c->hash.data, sizeof h.bytes);
	if (!u->writer) {
		const Farm__File *f = find_missing_file(u, &h);
		if (!f || f->size != c->size)
			return error_set(e, EINVAL, "a blob that was not requested");
		rc = blob_write_begin(&u->writer, u->blobs, &h, c->size, e);
		u->writer_hash = h;
	}
	if (!rc && (!blob_hash_equal(&h, &u->writer_hash) || c->offset != blob_write_offset(u->writer)))
		rc = error_set(e, EINVAL, "blobs must be sent one after the other and in order");
	if (!rc && size)
		rc = blob_write_append(u->writer, payload, size, e);
	if (rc)
		return rc;
	u->received_bytes += size;
	if (blob_write_offset(u->writer) < c->size) {
		blob_write_pause(u->writer); /* closes the file: thousands of clients may stop midway */
		return 0;
	}
	rc = add_to_batch(u, e);
	return rc ? rc : 1;
}

static void run_flush(uv_work_t *work)
{
	struct upload_flush *f = work->data;
	f->rc = blob_batch_flush(f->batch, &f->error);
	if (f->rc)
		blob_batch_discard(f->batch);
}

static void run_discard(uv_work_t *work)
{
	struct upload_flush *f = work->data;
	blob_batch_discard(f->leftover_batch);
}

static void on_discarded(uv_work_t *work, int status)
{
	(void)status;
	struct upload_flush *f = work->data;
	blob_batch_free(f->leftover_batch);
	mem_free(f);
}

static void on_flush_done(uv_work_t *work, int status)
{
	(void)status;
	struct upload_flush *f = work->data;
	struct upload *u = f->upload;
	if (u)
		u->flush = NULL;
	if (!f->rc) /* also if the upload was freed: the blobs are on the disk, and count */
		blob_batch_commit(f->batch);
	for (size_t i = 0; u && !f->rc && i < blob_batch_count(f->batch); i++)
		hold_blob(u, blob_batch_hash(f->batch, i));
	blob_batch_free(f->batch);
	/* Thousands of blobs may have arrived in the meantime, so the pool deletes them. */
	if (f->leftover_batch && uv_queue_work(work->loop, work, run_discard, on_discarded) == 0)
		return;
	blob_batch_free(f->leftover_batch);
	if (u)
		f->on_done(f->user, f->rc, &f->error);
	mem_free(f);
}

int upload_flush(struct upload *u, uv_loop_t *loop, upload_flush_callback done, void *user, struct error *e)
{
	if (u->flush || !u->batch)
		return 0;
	struct upload_flush *f = mem_alloc(1, sizeof *f);
	if (!f)
		return error_set(e, ENOMEM, "no memory for a submission");
	*f = (struct upload_flush){.upload = u, .batch = u->batch, .on_done = done, .user = user};
	f->work.data = f;
	int rc = uv_queue_work(loop, &f->work, run_flush, on_flush_done);
	if (rc) {
		mem_free(f);
		return error_set(e, -rc, "its files cannot be flushed: %s", uv_strerror(rc));
	}
	u->flush = f;
	u->batch = NULL;
	return 0;
}

size_t upload_missing_hashes(const struct upload *u, struct blob_hash *hashes)
{
	const Farm__Submit *m = u->submission.message->submit;
	size_t count = 0;
	for (size_t at = 0; at < m->n_files; at++) {
		struct blob_hash h = file_hash_from_wire(m->files[u->by_hash[at]]);
		if (!u->is_held[u->by_hash[at]] && (count == 0 || !blob_hash_equal(&hashes[count - 1], &h)))
			hashes[count++] = h;
	}
	return count;
}
