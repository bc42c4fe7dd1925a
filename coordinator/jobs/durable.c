/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Everything that must be on disk before it is acknowledged: submissions, results, the ends of jobs.
 *
 * Results: durable_reserve_result reserves space in the journal and the films before the core sees a result, so merging
 * it cannot fail for lack of space. durable_append_result appends it. durable_ack queues its acknowledgement;
 * flush_next flushes the journals of all queued acknowledgements in the thread pool (group commit), and
 * on_journals_flushed sends them.
 *
 * A full or failing disk never loses an acknowledged result: the job is held with the reason, its acknowledgements
 * are parked, and durable_retry_job tries again every retry_seconds, with a new journal if the old one cannot be
 * trusted. A job whose end cannot be recorded stays in a list of endings until it can; disk space for that is kept
 * (spool_create_reserve). Only running out of memory for these lists (some 200 bytes) ends the process.
 */
#include "coordinator/jobs/durable.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "common/base/text.h"
#include "common/base/version.h"
#include "common/wire/frame.h"
#include "coordinator/live_job/incoming.h"
#include "coordinator/live_job/stored.h"
#include "coordinator/jobs/storage.h"
#include "coordinator/jobs/step.h"
#include "coordinator/retention/kept_films.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

enum {
	PINNED_RECORD_BYTES = 512 /* bytes for the record of the fingerprint, which is written before the first batch */
};
enum { NO_PEER = 0 /* no peer: peers are numbered from 1 */ };

/* A job whose end is not recorded on disk yet. */
struct unrecorded_end {
	struct unrecorded_end *next;
	struct job_record record;
	bool has_kept_films; /* its films are kept (kept_films.h), and it may be extended meanwhile */
};

struct durable_ack {
	STAILQ_ENTRY(durable_ack) next;
	uint64_t peer; /* NO_PEER: no peer waits for the answer */
	struct lease_key key;
	enum ack ack;
	int flush_error;	 /* -errno of the flush; 0: none */
	struct journal *journal; /* a reference */
};

/* A flush of the journals of all acknowledgements queued before it. */
struct journal_flush {
	uv_work_t work;
	struct jobs *jobs;
	struct ack_list acks;
};

static int pack_plan(const struct live_job *job, unsigned char **frame, size_t *size, struct error *e)
{
	Farm__Plan plan;
	plan_to_wire(&job->plan, &plan);
	return envelope_pack(ENVELOPE(JOB_INFO, job_info, .job = job->id, .plan = &plan), NULL, 0, frame, size, e);
}

int durable_pack_job(const struct live_job *job, struct ledger_job *j, unsigned char **submission, unsigned char **plan,
		     struct error *e)
{
	*submission = *plan = NULL;
	int rc = envelope_pack(job->submission.message, NULL, 0, submission, &j->submission_size, e);
	if (!rc)
		rc = pack_plan(job, plan, &j->plan_size, e);
	j->submission = *submission;
	j->plan = *plan;
	return rc;
}

int durable_add_job(struct jobs *jobs, struct live_job *job, struct error *e)
{
	char folder[SPOOL_PATH_MAX];
	unsigned char *submission, *plan;
	char *record = NULL;
	struct ledger_job j = {.id = job->id,
			       .owner = job->record.owner,
			       .name = job->record.name,
			       .version = HSLT_VERSION,
			       .priority = job->record.priority,
			       .is_mixed = live_job_submission(job)->mixed,
			       .submitted = job->record.submitted};
	spool_job_path(jobs->spool, job->id, NULL, folder);
	int rc = durable_pack_job(job, &j, &submission, &plan, e);
	if (!rc)
		rc = record_to_json(&job->record, &record, e);
	if (!rc)
		rc = journal_create(&job->journal, folder, job->id, 0, e);
	if (!rc) {
		j.record = record;
		rc = ledger_add(jobs->ledger, &j, e);
		if (rc) /* it may have been written in spite of the error, and the client is told that it failed */
			ledger_delete(jobs->ledger, job->id, NULL);
	}
	mem_free(record);
	mem_free(submission);
	mem_free(plan);
	return rc;
}

/* Records the end of a job. If it has no result, this must also work on a full disk, since its end may be all that
 * frees space, so the reserve is used. */
static int ledger_end_with_reserve(struct jobs *jobs, const struct job_record *r, bool films_kept, struct error *e)
{
	int rc = ledger_end_job(jobs->ledger, r, films_kept, e);
	return disk_is_full(rc) && !r->has_result && spool_release_reserve(jobs->spool)
		       ? ledger_end_job(jobs->ledger, r, films_kept, e)
		       : rc;
}

/* Records the end of a job, and deletes its films once the ledger durably contains the end. has_kept_films: the films
 * stay (kept_films.h). */
static int write_end(struct jobs *jobs, const struct job_record *r, bool has_kept_films, struct error *e)
{
	int rc = ledger_end_job(jobs->ledger, r, has_kept_films, e);
	if (rc && !r->has_result && !has_kept_films) /* its films are useless now, and may be what fills the disk */
		kept_films_drop(jobs, r->id);
	if (disk_is_full(rc))
		kept_films_drop_all(jobs);
	if (rc)
		rc = ledger_end_with_reserve(jobs, r, has_kept_films, e);
	if (!rc && !has_kept_films)
		kept_films_drop(jobs, r->id);
	return rc;
}

static void queue_ending(struct jobs *jobs, const struct job_record *r, bool films_kept)
{
	struct unrecorded_end *n = mem_alloc(1, sizeof *n);
	if (!n)
		return;
	*n = (struct unrecorded_end){jobs->unrecorded_ends, *r, films_kept};
	jobs->unrecorded_ends = n;
	jobs->unrecorded_ends_retry_at = jobs_now(jobs) + jobs->config.retry_seconds;
}

void durable_restore_end(struct jobs *jobs, const struct job_record *r)
{
	struct error e;
	if (ledger_end_job(jobs->ledger, r, true, &e) == 0)
		return;
	log_event(LOG_SPOOL_FAULT, "job=j%llu text=%s action=\"it will be tried again\"", (unsigned long long)r->id,
		  log_quote(e.text).text);
	queue_ending(jobs, r, true);
}

int durable_end_job(struct jobs *jobs, struct live_job *job)
{
	struct error e;
	if (journal_write(job->journal, &e)) /* for an extension; results that are not written are computed again */
		live_job_log(job, LOG_SPOOL_FAULT, "text=%s", log_quote(e.text).text);
	int rc = write_end(jobs, &job->record, kept_films_are_wanted(jobs, job, &job->record), &e);
	if (rc)
		live_job_log(job, LOG_SPOOL_FAULT, "text=%s action=\"it will be tried again\"", log_quote(e.text).text);
	if (rc && job->record.has_result) {
		text_copy(job->record.why, sizeof job->record.why, e.text);
		return rc;
	}
	if (!rc)
		journal_mark_settled(job->journal); /* nothing that still waits for a flush is needed any more */
	journal_release(job->journal);		    /* its space is freed together with its last reference */
	job->journal = NULL;
	/* The journal that write_end deleted took up space until now. */
	if (rc && write_end(jobs, &job->record, false, &e))
		queue_ending(jobs, &job->record, false);
	return 0;
}

int durable_end_early(struct jobs *jobs, const struct live_job *job, const struct job_record *r, struct error *e)
{
	return ledger_end_with_reserve(jobs, r, kept_films_are_wanted(jobs, job, r), e);
}

int durable_check_ended(const struct jobs *jobs, uint64_t job, struct error *e)
{
	for (const struct unrecorded_end *n = jobs->unrecorded_ends; n; n = n->next)
		if (n->record.id == job)
			return error_set(e, EIO, "its record cannot be written yet, and is tried again");
	return 0;
}

static void retry_endings(struct jobs *jobs)
{
	struct error e;
	if (!jobs->unrecorded_ends || jobs_now(jobs) < jobs->unrecorded_ends_retry_at)
		return;
	jobs->unrecorded_ends_retry_at = jobs_now(jobs) + jobs->config.retry_seconds;
	for (struct unrecorded_end *n; (n = jobs->unrecorded_ends);) {
		if (write_end(jobs, &n->record, n->has_kept_films, &e))
			return;
		jobs->unrecorded_ends = n->next;
		mem_free(n);
	}
}

static void set_storage_hold(struct jobs *jobs, struct live_job *job, const char *text)
{
	struct event ev = {.kind = EVENT_HOLD, .job = job->id, .text = text};
	if (!*text != !job->is_held_for_storage) {
		live_job_log(job, *text ? LOG_JOB_HELD : LOG_JOB_STATE, "state=%s text=%s", *text ? "held" : "released",
			     log_quote(text).text);
		job->is_held_for_storage = *text != 0;
	}
	job->retry_at = jobs_now(jobs) + jobs->config.retry_seconds;
	jobs_step(jobs, &ev);
}

void durable_hold_job(struct jobs *jobs, struct live_job *job, const char *consequence, const char *cause)
{
	char text[256];
	text_print(text, sizeof text, "%s: %s", consequence, cause);
	set_storage_hold(jobs, job, text);
}

/* Checks whether memory has room for the result's chain states, if they are larger than those that they replace. */
static int reserve_memory(const struct jobs *jobs, struct live_job *job, const struct batch *b, struct error *e)
{
	const struct chain_state *current = job->states[(size_t)b->key.group * job->plan.parts + b->key.part];
	uint64_t before = chain_states_bytes(current, job->chains_per_lease);
	uint64_t after = chain_states_bytes(b->states, b->state_count);
	uint64_t total = job->state_bytes - before + after,
		 blocker = after > before ? storage_find_states_blocker(jobs, job, total) : 0;
	job->blocked_state_bytes = blocker ? total : 0;
	return blocker ? error_set(e, ENOMEM, "memory has no room for its chain states beside those of j%llu",
				   (unsigned long long)blocker)
		       : 0;
}

static int reserve_disk(struct jobs *jobs, struct live_job *job, const struct incoming *in, size_t size,
			struct error *e)
{
	int rc;
	do {
		uint64_t blocker = storage_find_write_blocker(jobs, job);
		rc = blocker ? error_set(e, ENOSPC,
					 "the disk has no room for its results besides those of j%llu, which go first",
					 (unsigned long long)blocker)
		     : storage_fits_checkpoint(jobs, job, size)
			     ? journal_reserve(job->journal, size + PINNED_RECORD_BYTES, e)
			     : error_set(e, ENOSPC,
					 "the space left on the disk is needed for a checkpoint of its results");
		if (!rc && job->canvas && in->batch->key.kind == LEASE_RENDER)
			rc = canvas_reserve(job->canvas, in->batch, e);
	} while (disk_is_full(rc) && storage_evict(jobs));
	return rc;
}

int durable_reserve_result(struct jobs *jobs, struct live_job *job, struct incoming *in, struct error *e)
{
	union {
		const Farm__LeaseResult *from;
		Farm__LeaseResult *to;
	} result = {in->result}; /* generated structures have no const members */
	if (job->is_checkpoint_uncertain)
		return error_set(e, EIO, "the job's files cannot be written");
	int rc = envelope_pack(ENVELOPE_OF(LEASE_RESULT, lease_result, result.to), NULL, 0, &in->frame, &in->frame_size,
			       e);
	if (rc)
		return rc;
	size_t size = in->frame_size + in->payload->size;
	frame_prefix_write(in->frame, (uint32_t)(in->frame_size - FRAME_PREFIX_SIZE), (uint32_t)in->payload->size);
	rc = reserve_memory(jobs, job, in->batch, e);
	if (!rc)
		rc = reserve_disk(jobs, job, in, size, e);
	if (!rc)
		return 0;
	job->blocked_result_bytes = size;
	durable_hold_job(jobs, job, "its results cannot be stored", e->text);
	return rc;
}

/* Appends the job's fingerprint to the journal, once, before its first batch. */
static int write_pinned(struct jobs *jobs, struct live_job *job, double elapsed, struct error *e)
{
	struct job_status status;
	if (job->is_fingerprint_journaled || !farm_job_status(jobs->farm, job->id, jobs_now(jobs), &status) ||
	    !*status.fingerprint)
		return 0;
	job->is_fingerprint_journaled = true;
	return journal_append(job->journal, JOURNAL_FINGERPRINT, NULL, elapsed, status.fingerprint,
			      strlen(status.fingerprint), NULL, e);
}

int durable_append_result(struct jobs *jobs, struct live_job *job, const struct incoming *in, uint64_t *offset,
			  struct error *e)
{
	const struct lease_key *k = &in->batch->key;
	bool is_replacement =
		k->kind == LEASE_RENDER && job->is_replacement[(size_t)k->group * job->plan.parts + k->part];
	double elapsed = farm_job_elapsed(jobs->farm, job->id, jobs_now(jobs));
	assert(in->frame);
	int rc = write_pinned(jobs, job, elapsed, e);
	*offset = journal_bytes(job->journal);
	return rc ? rc
		  : journal_append(job->journal, is_replacement ? JOURNAL_BATCH_REPLACEMENT : JOURNAL_BATCH, k, elapsed,
				   in->frame, in->frame_size, in->payload, e);
}

static void flush_next(struct jobs *jobs);

static void flush_journals(uv_work_t *work)
{
	struct journal_flush *w = work->data;
	struct durable_ack *a;
	STAILQ_FOREACH(a, &w->acks, next) {
		struct error e;
		a->flush_error = journal_sync(a->journal, &e);
		if (a->flush_error)
			log_event(LOG_SPOOL_FAULT, "text=%s", log_quote(e.text).text);
	}
}

static void drop_ack(struct durable_ack *a)
{
	journal_release(a->journal);
	mem_free(a);
}

/* Keeps an acknowledgement whose flush failed until the journal is replaced. */
static void park_ack(struct jobs *jobs, struct durable_ack *a)
{
	struct live_job *job = jobs->is_stopping ? NULL : jobs_find_live(jobs, a->key.job);
	if (!job) {
		drop_ack(a);
		return;
	}
	if (a->journal != job->journal) { /* the journal has been replaced */
		STAILQ_INSERT_TAIL(&jobs->acks, a, next);
		return;
	}
	STAILQ_INSERT_HEAD(&jobs->parked_acks, a, next);
	if (!job->is_held_for_storage)
		durable_hold_job(jobs, job, "its results cannot be stored", strerror(-a->flush_error));
}

static void finish_ack(struct jobs *jobs, struct durable_ack *a)
{
	if (a->flush_error) {
		park_ack(jobs, a);
		return;
	}
	if (a->ack == ACK_MERGED)
		log_event(LOG_BATCH_STORED, "job=j%llu peer=%llu " LEASE_FORMAT, log_u64_arg(a->key.job),
			  log_u64_arg(a->peer), LEASE_VALUES(&a->key));
	if (!jobs->is_stopping && a->peer != NO_PEER)
		jobs->peers.acknowledge_result(jobs->peers.user, a->peer, &a->key, a->ack, "");
	drop_ack(a);
}

static void on_journals_flushed(uv_work_t *work, int status)
{
	struct journal_flush *w = work->data;
	struct jobs *jobs = w->jobs;
	assert(status == 0);
	(void)status;
	jobs->is_flushing = false;
	for (struct durable_ack *a; (a = STAILQ_FIRST(&w->acks));) {
		STAILQ_REMOVE_HEAD(&w->acks, next);
		finish_ack(jobs, a);
	}
	mem_free(w);
	flush_next(jobs);
}

static void flush_next(struct jobs *jobs)
{
	if (jobs->is_flushing || STAILQ_EMPTY(&jobs->acks))
		return;
	struct journal_flush *w = mem_alloc(1, sizeof *w);
	if (!w) /* as with events: without 200 bytes nothing can continue */
		abort();
	w->jobs = jobs;
	STAILQ_INIT(&w->acks);
	STAILQ_CONCAT(&w->acks, &jobs->acks);
	jobs->is_flushing = true;
	jobs_queue_work(jobs, &w->work, w, flush_journals, on_journals_flushed);
}

void durable_ack(struct jobs *jobs, const struct live_job *job, uint64_t peer, const struct lease_key *k, enum ack ack)
{
	struct durable_ack *a = mem_alloc(1, sizeof *a);
	if (!a) /* no answer: the worker will send the result again, as a repeat */
		return;
	*a = (struct durable_ack){.peer = peer, .key = *k, .ack = ack, .journal = job->journal};
	journal_hold(a->journal);
	STAILQ_INSERT_TAIL(&jobs->acks, a, next);
	flush_next(jobs);
}

/* Appends a record that nobody waits for; it is flushed soon, but not at once. */
static int append_note(struct jobs *jobs, const struct live_job *job, enum journal_kind kind, double elapsed,
		       const void *bytes, size_t size, struct error *e)
{
	int rc = journal_append(job->journal, kind, NULL, elapsed, bytes, size, NULL, e);
	if (!rc)
		durable_ack(jobs, job, NO_PEER, &(struct lease_key){.job = job->id}, ACK_REPEATED);
	return rc;
}

void durable_store_look(struct jobs *jobs, uint64_t id)
{
	struct live_job *job = jobs_find_live(jobs, id);
	struct job_status status;
	struct error e;
	if (!job || !farm_job_status(jobs->farm, id, jobs_now(jobs), &status) || status.looks->count == 0)
		return;
	const struct forecast_look *l = &status.looks->looks[status.looks->count - 1];
	if (l->work <= job->last_stored_look_work)
		return;
	job->last_stored_look_work = l->work;
	/* Only forecasts use it: after a restart the estimate itself is made again. */
	unsigned char note[STORED_NOTE_MAX];
	size_t size = stored_pack_look(l, note);
	if (append_note(jobs, job, JOURNAL_LOOK, farm_job_elapsed(jobs->farm, id, jobs_now(jobs)), note, size, &e))
		log_event(LOG_SPOOL_FAULT, "job=j%llu text=%s", (unsigned long long)id, log_quote(e.text).text);
}

/* Appends the job's counters if they have changed. They are only informative, so they are not written before each
 * acknowledgement; nor during a checkpoint, which contains the latest counters and replaces the journal. */
static void write_counts(struct jobs *jobs, struct live_job *job)
{
	struct job_counts current;
	struct error e;
	if (job->has_ended || job->is_busy || !farm_job_counts(jobs->farm, job->id, &current) ||
	    memcmp(&current, &job->record.counts, sizeof current) == 0)
		return;
	unsigned char note[STORED_NOTE_MAX];
	if (append_note(jobs, job, JOURNAL_COUNTS, job->times.elapsed, note, stored_pack_counts(&current, note), &e) ==
	    0)
		job->record.counts = current;
}

/* Queues the parked acknowledgements whose journals have been replaced, for another flush. */
static void release_parked_acks(struct jobs *jobs)
{
	struct ack_list list = STAILQ_HEAD_INITIALIZER(list);
	STAILQ_CONCAT(&list, &jobs->parked_acks);
	for (struct durable_ack *a; (a = STAILQ_FIRST(&list));) {
		struct live_job *job = jobs_find_live(jobs, a->key.job);
		STAILQ_REMOVE_HEAD(&list, next);
		if (!job) {
			drop_ack(a);
		} else if (a->journal == job->journal && journal_is_bad(a->journal)) {
			STAILQ_INSERT_HEAD(&jobs->parked_acks, a, next);
		} else {
			STAILQ_INSERT_TAIL(&jobs->acks, a, next);
		}
	}
	flush_next(jobs);
}

int durable_retry_job(struct jobs *jobs, struct live_job *job)
{
	struct error e;
	job->retry_at = jobs_now(jobs) + jobs->config.retry_seconds;
	if (job->is_checkpoint_uncertain ||
	    (job->blocked_state_bytes && storage_find_states_blocker(jobs, job, job->blocked_state_bytes)) ||
	    storage_find_write_blocker(jobs, job))
		return -EAGAIN;
	int rc;
	do {
		rc = journal_is_bad(job->journal) ? journal_renew(job->journal, &e) : 0;
		if (rc && rc != -EAGAIN)
			live_job_log(job, LOG_SPOOL_FAULT, "text=%s", log_quote(e.text).text);
		/* Otherwise the next result would be held again. */
		if (!rc && !storage_fits_checkpoint(jobs, job, 2 * job->blocked_result_bytes))
			rc = -ENOSPC;
		if (!rc)
			rc = journal_reserve(job->journal, 2 * job->blocked_result_bytes, &e);
		/* storage_evict deletes scene files and films that were kept for later use. */
	} while (disk_is_full(rc) && storage_evict(jobs));
	if (!rc)
		set_storage_hold(jobs, job, "");
	return rc;
}

static void retry_ledger(struct jobs *jobs)
{
	struct error e;
	if (jobs_now(jobs) < jobs->ledger_retry_at)
		return;
	jobs->ledger_retry_at = jobs_now(jobs) + jobs->config.retry_seconds;
	if (ledger_repair_copy(jobs->ledger, &e))
		log_event(LOG_SPOOL_FAULT, "text=%s action=\"it will be tried again\"", log_quote(e.text).text);
	spool_create_reserve(jobs->spool);
}

void durable_tick(struct jobs *jobs)
{
	for (struct live_job *job = jobs->live_jobs; job; job = job->next)
		write_counts(jobs, job);
	if (!STAILQ_EMPTY(&jobs->parked_acks))
		release_parked_acks(jobs);
	retry_endings(jobs);
	retry_ledger(jobs);
}

void durable_close(struct jobs *jobs)
{
	assert(!jobs->is_flushing && STAILQ_EMPTY(&jobs->acks));
	for (struct durable_ack *a; (a = STAILQ_FIRST(&jobs->parked_acks));) {
		STAILQ_REMOVE_HEAD(&jobs->parked_acks, next);
		drop_ack(a);
	}
	for (struct unrecorded_end *n; (n = jobs->unrecorded_ends);) {
		jobs->unrecorded_ends = n->next;
		mem_free(n);
	}
	ledger_close(jobs->ledger);
}
