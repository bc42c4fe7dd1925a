/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Writes and reads a job's checkpoint, part by part in the order of checkpoint_file.h.
 *
 * A change of anything behind the head needs a new version number. Files of version 004, whose head is numbers at
 * fixed offsets, can still be read.
 *
 * A damaged file is -EBADMSG, one of another version -EPROTO. Sizes are checked before anything is allocated.
 */
#include "coordinator/live_job/checkpoint_file.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "common/film/canvas_save.h"

#include <stdio.h>
#include <string.h>

static const char magic[8] = "hsltC005", old_magic[8] = "hsltC004";

static uint32_t slot_count(const struct live_job *job)
{
	return job->plan.groups * job->plan.parts;
}

void checkpoint_head_fill(struct checkpoint_head *h, const struct live_job *job, const struct job_status *status)
{
	uint64_t generation = journal_generation(job->journal) + 1;
	*h = (struct checkpoint_head){.worker_count = job->worker_count,
				      .job = job->id,
				      .generation = generation < job->min_generation ? job->min_generation : generation,
				      .cpu_seconds = job->record.cpu_seconds,
				      .bootstrap_cpu_seconds = job->record.bootstrap_cpu_seconds,
				      .look_written = job->last_stored_look_work,
				      .times = job->times,
				      .bootstrap_result = job->bootstrap_result,
				      .counts = job->record.counts,
				      .looks = *status->looks};
	snprintf(h->fingerprint, sizeof h->fingerprint, "%s", status->fingerprint);
}

static int write_states(const struct live_job *job, struct checked_file *out, struct error *e)
{
	int rc = 0;
	for (uint32_t i = 0; i < slot_count(job) && !rc; i++) {
		uint32_t has_states = job->states[i] != NULL;
		rc = checked_file_write_numbers(out, &has_states, sizeof has_states, 1, e);
		for (uint32_t k = 0; has_states && k < job->chains_per_lease && !rc; k++) {
			const struct chain_state *c = &job->states[i][k];
			rc = checked_file_write_numbers(out, &c->size, sizeof c->size, 1, e);
			if (!rc)
				rc = checked_file_write(out, c->bytes, c->size, e);
		}
	}
	return rc;
}

static int write_head(const struct checkpoint_head *h, struct checked_file *out, struct error *e)
{
	unsigned char bytes[STORED_HEAD_MAX];
	uint32_t size = (uint32_t)stored_pack_head(h, bytes);
	int rc = checked_file_write(out, magic, sizeof magic, e);
	if (!rc)
		rc = checked_file_write_numbers(out, &size, sizeof size, 1, e);
	return rc ? rc : checked_file_write(out, bytes, size, e);
}

int checkpoint_write(const struct live_job *job, const struct checkpoint_head *h, struct checked_file *out,
		     struct error *e)
{
	int rc = write_head(h, out, e);
	if (!rc && job->seeds)
		rc = checked_file_write_numbers(out, job->seeds, sizeof *job->seeds, job->plan.chains, e);
	if (!rc)
		rc = write_states(job, out, e);
	return rc ? rc : canvas_save(job->canvas, out, e);
}

static int read_states(struct live_job *job, struct checked_file *in, struct error *e)
{
	int rc = 0;
	for (uint32_t i = 0; i < slot_count(job) && !rc; i++) {
		uint32_t has_states;
		rc = checked_file_read_numbers(in, &has_states, sizeof has_states, 1, e);
		if (rc || !has_states)
			continue;
		job->states[i] = mem_alloc(job->chains_per_lease, sizeof *job->states[i]);
		if (!job->states[i])
			return error_set(e, ENOMEM, "no memory for chains");
		for (uint32_t k = 0; k < job->chains_per_lease && !rc; k++) {
			struct chain_state *c = &job->states[i][k];
			uint32_t size;
			rc = checked_file_read_numbers(in, &size, sizeof size, 1, e);
			if (!rc && (size == 0 || size > chain_state_max_bytes(&job->plan)))
				rc = error_set(e, EBADMSG, "the state of a chain has %u bytes", size);
			if (!rc && !(c->bytes = mem_alloc(size, 1)))
				rc = error_set(e, ENOMEM, "no memory for chains");
			if (!rc) {
				c->size = size;
				rc = checked_file_read(in, c->bytes, size, e);
			}
		}
		job->state_bytes += chain_states_bytes(job->states[i], job->chains_per_lease);
	}
	return rc;
}

static void apply_head(struct live_job *job, const struct checkpoint_head *h)
{
	job->worker_count = h->worker_count;
	job->record.cpu_seconds = h->cpu_seconds;
	job->record.bootstrap_cpu_seconds = h->bootstrap_cpu_seconds;
	job->last_stored_look_work = h->look_written;
	job->times = h->times;
	job->bootstrap_result = h->bootstrap_result;
	job->record.looks.count = 0;
	for (uint32_t i = 0; i < h->looks.count && i < FORECAST_LOOKS_MAX; i++)
		forecast_add_look(&job->record.looks, &h->looks.looks[i]);
	job->record.counts = h->counts;
	snprintf(job->fingerprint, sizeof job->fingerprint, "%s", h->fingerprint);
}

/* Reads the head of a file of version 004. */
static int read_old_head(struct checkpoint_head *h, struct checked_file *in, struct error *e)
{
	unsigned char bytes[STORED_OLD_HEAD_SIZE];
	uint32_t sizes[2]; /* size of the head; worker_count */
	int rc = checked_file_read_numbers(in, sizes, sizeof *sizes, 2, e);
	if (!rc && sizes[0] != sizeof magic + sizeof sizes + sizeof bytes)
		rc = error_set(e, EPROTO, "%s: its head has %u bytes: a coordinator for another machine wrote it",
			       in->path, sizes[0]);
	if (!rc)
		rc = checked_file_read(in, bytes, sizeof bytes, e);
	if (!rc)
		stored_unpack_old_head(bytes, sizes[1], h);
	return rc;
}

static int read_head(struct checkpoint_head *h, struct checked_file *in, struct error *e)
{
	unsigned char bytes[STORED_HEAD_MAX];
	char file_magic[sizeof magic];
	uint32_t size;
	int rc = checked_file_read(in, file_magic, sizeof file_magic, e);
	if (!rc && memcmp(file_magic, old_magic, sizeof file_magic) == 0)
		return read_old_head(h, in, e);
	if (!rc)
		rc = spool_check_version(file_magic, magic, in->path, e);
	if (!rc)
		rc = checked_file_read_numbers(in, &size, sizeof size, 1, e);
	if (!rc && size > sizeof bytes)
		rc = error_set(e, EPROTO, "%s: its head has %u bytes", in->path, size);
	if (!rc)
		rc = checked_file_read(in, bytes, size, e);
	if (!rc && (rc = stored_unpack_head(bytes, size, h, e)))
		error_prefix(e, rc, "%s", in->path);
	return rc;
}

static int read_checkpoint(struct live_job *job, struct checked_file *in, uint64_t *generation, struct error *e)
{
	struct checkpoint_head h;
	int rc = read_head(&h, in, e);
	if (!rc && h.job != job->id)
		rc = error_set(e, EBADMSG, "%s: of j%llu", in->path, (unsigned long long)h.job);
	if (rc)
		return rc;
	apply_head(job, &h);
	*generation = h.generation;
	int exponent =
		canvas_grid_exponent(&job->plan, job->bootstrap_result.b_pooled, live_job_submission(job)->brightest);
	rc = canvas_new(&job->canvas, &job->plan, exponent, job->film_folder, e);
	if (!rc && job->seeds)
		rc = checked_file_read_numbers(in, job->seeds, sizeof *job->seeds, job->plan.chains, e);
	if (!rc)
		rc = read_states(job, in, e);
	if (!rc)
		rc = canvas_load(job->canvas, in, e);
	if (!rc)
		rc = checked_file_expect_end(in, e);
	bootstrap_free(job->bootstrap);
	job->bootstrap = NULL;
	job->checkpoint_bytes = in->bytes_written;
	return rc;
}

int checkpoint_load(const struct spool *spool, struct live_job *job, uint64_t *generation,
		    checked_file_progress *progress, void *user, struct error *e)
{
	char name[SPOOL_PATH_MAX];
	struct checked_file in;
	spool_job_path(spool, job->id, "checkpoint.tmp", name);
	disk_unlink(name); /* left behind by a run that ended while writing it */
	spool_job_path(spool, job->id, "checkpoint", name);
	int rc = checked_file_open_with_progress(&in, name, progress, user, e);
	if (rc)
		return rc;
	in.bytes_written = in.remaining_bytes;
	rc = read_checkpoint(job, &in, generation, e);
	checked_file_close(&in);
	return rc;
}
