/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/live_job/rollback.h"

#include "common/base/list.h"
#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/live_job/late_results.h"

#include <assert.h>
#include <string.h>

static uint32_t slot_index(const struct live_job *job, const struct lease_key *k)
{
	return k->group * job->plan.parts + k->part;
}

static struct lease_key record_key(const struct live_job *job, const struct merged_record *r)
{
	return (struct lease_key){job->id, LEASE_RENDER, r->slot / job->plan.parts, r->slot % job->plan.parts,
				  r->epoch};
}

static void copy_maker(struct live_job_maker *to, const Farm__Maker *from)
{
	*to = (struct live_job_maker){0};
	if (!from)
		return;
	text_copy(to->name, sizeof to->name, from->name);
	text_copy(to->certificate, sizeof to->certificate, from->certificate);
	text_copy(to->home, sizeof to->home, from->home);
	to->restarts = from->restarts;
}

void rollback_note_batch(struct live_job *job, const struct lease_key *k, uint64_t offset, const Farm__Maker *maker)
{
	if (job->plan.kind != PLAN_CHAINS || k->kind != LEASE_RENDER)
		return;
	struct merged_record *more = list_grow_array(job->merged_records, job->merged_record_count, sizeof *more);
	if (!more)
		return;
	job->merged_records = more;
	job->merged_records[job->merged_record_count++] = (struct merged_record){slot_index(job, k), k->epoch, offset};
	copy_maker(&job->makers[slot_index(job, k)], maker);
}

/* Returns SIZE_MAX if not found. */
static size_t find_record(const struct live_job *job, uint32_t slot, uint64_t epoch)
{
	for (size_t i = job->merged_record_count; i-- > 0;)
		if (job->merged_records[i].slot == slot && job->merged_records[i].epoch == epoch)
			return i;
	return SIZE_MAX;
}

static int read_batch(const struct live_job *job, struct journal *j, const struct lease_key *k, struct batch *b,
		      struct live_job_maker *maker, struct error *e)
{
	size_t i = find_record(job, slot_index(job, k), k->epoch), size, payload_size;
	unsigned char *body;
	const unsigned char *payload;
	struct envelope env;
	if (i == SIZE_MAX)
		return error_set(e, ENOENT, "the batch of an epoch is not in the journal");
	int rc = journal_read_body(j, job->merged_records[i].offset, &body, &size, e);
	if (rc)
		return rc;
	rc = envelope_unpack_frame(&env, FARM__ENVELOPE__BODY_LEASE_RESULT, body, size, &payload, &payload_size, e);
	if (!rc) {
		rc = batch_unpack(b, &job->plan, env.message->lease_result, payload, payload_size, e);
		copy_maker(maker, env.message->lease_result->maker);
		envelope_fini(&env);
	}
	mem_free(body);
	if (!rc && !lease_key_equal(&b->key, k))
		rc = error_set(e, EBADMSG, "the journal has another batch there");
	return rc;
}

int rollback_read(const struct live_job *job, struct journal *j, const struct lease_key *k, struct rollback *b,
		  struct error *e)
{
	struct lease_key last = *k;
	struct batch before = {0};
	*b = (struct rollback){0};
	last.epoch--;
	if (job->plan.kind != PLAN_CHAINS || k->kind != LEASE_RENDER || k->group >= job->plan.groups ||
	    k->part >= job->plan.parts || k->epoch == 0 || !job->canvas || canvas_has_lease(job->canvas, k) ||
	    !canvas_has_lease(job->canvas, &last))
		return error_set(e, ENOENT, "not the lease that is next");
	int rc = read_batch(job, j, &last, &b->batch, &b->maker, e);
	b->maker = (struct live_job_maker){0};
	if (!rc && last.epoch > 0) {
		last.epoch--;
		rc = read_batch(job, j, &last, &before, &b->maker, e);
		b->states = before.states;
		before.states = NULL;
		before.state_count = 0;
	}
	batch_fini(&before);
	if (rc)
		rollback_fini(b);
	return rc;
}

void rollback_apply(struct live_job *job, struct rollback *b)
{
	const struct lease_key *k = &b->batch.key;
	uint32_t slot = slot_index(job, k);
	size_t i = find_record(job, slot, k->epoch);
	assert(i != SIZE_MAX);
	memmove(&job->merged_records[i], &job->merged_records[i + 1],
		(--job->merged_record_count - i) * sizeof *job->merged_records);
	canvas_subtract(job->canvas, &b->batch);
	live_job_set_states(job, slot, b->states);
	b->states = NULL;
	job->makers[slot] = b->maker;
	job->is_replacement[slot] = true;
	job->record.cpu_seconds -= b->batch.cpu_seconds;
}

void rollback_fini(struct rollback *b)
{
	if (b->states)
		chain_states_free(b->states, b->batch.state_count);
	batch_fini(&b->batch);
	*b = (struct rollback){0};
}

int rollback_replay(struct live_job *job, struct journal *j, const struct lease_key *k, struct error *e)
{
	int rc = 0;
	late_results_remove_from_epoch(job, k);
	if (!job->canvas || k->group >= job->plan.groups || k->part >= job->plan.parts)
		return 0;
	while (!rc && canvas_has_lease(job->canvas, k)) {
		struct lease_key next = *k;
		struct rollback b;
		do
			next.epoch++;
		while (canvas_has_lease(job->canvas, &next));
		rc = rollback_read(job, j, &next, &b, e);
		if (rc) /* an undamaged journal contains all batches */
			return rc == -ENOENT ? error_set(e, EBADMSG, "a batch that was replaced is not in the journal")
					     : rc;
		rollback_apply(job, &b);
		rollback_fini(&b);
		job->is_replacement[slot_index(job, k)] = false;
	}
	return rc;
}

static uint64_t copy_record(const struct live_job *job, struct journal *to, const struct merged_record *r,
			    uint64_t max_bytes, struct merged_record *out)
{
	struct error e;
	unsigned char *body;
	size_t size;
	struct lease_key k = record_key(job, r);
	if (journal_read_body(job->journal, r->offset, &body, &size, &e))
		return 0;
	*out = (struct merged_record){r->slot, r->epoch, journal_bytes(to)};
	bool copied = size <= max_bytes &&
		      journal_append(to, JOURNAL_MERGED_BATCH, &k, job->times.elapsed, body, size, NULL, &e) == 0 &&
		      journal_write(to, &e) == 0;
	mem_free(body);
	return copied ? size : 0;
}

void rollback_copy_records(const struct live_job *job, struct journal *to, uint64_t max_bytes,
			   struct merged_record **list, size_t *count)
{
	enum { KEPT_BATCHES = 2 };
	uint32_t slots = job->plan.groups * job->plan.parts;
	struct error e;
	*list = NULL;
	*count = 0;
	if (journal_write(job->journal, &e)) /* records that are still queued cannot be read */
		return;
	for (uint32_t s = 0; s < slots; s++) {
		uint64_t next = 0;
		for (size_t i = 0; i < job->merged_record_count; i++)
			if (job->merged_records[i].slot == s && job->merged_records[i].epoch >= next)
				next = job->merged_records[i].epoch + 1;
		for (uint64_t epoch = next < KEPT_BATCHES ? 0 : next - KEPT_BATCHES; epoch < next; epoch++) {
			size_t i = find_record(job, s, epoch);
			struct merged_record *more =
				i == SIZE_MAX ? NULL : list_grow_array(*list, *count, sizeof *more);
			if (!more)
				continue;
			*list = more;
			uint64_t size = copy_record(job, to, &job->merged_records[i], max_bytes, &more[*count]);
			*count += size > 0;
			max_bytes -= size;
		}
	}
}
