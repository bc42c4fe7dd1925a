/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reads a job's merged results from the disk into its films.
 *
 * replay_films reads the checkpoint, if there is one, and then the journal that follows it. Each result goes through
 * the same code as results of workers. A result whose predecessor is missing is noted (late_results.h) and tried again
 * at the end. Other records restore fingerprint, times, estimates of the error and counters.
 *
 * A damaged record is skipped, counted and logged in the job's log: its lease is computed again. A damaged checkpoint
 * is -EBADMSG. An undamaged record that makes no sense was written by another version: -EPROTO. After either of these
 * the job must be dropped. A stop requested by another thread is -ECANCELED.
 */
#include "coordinator/live_job/replay.h"

#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/live_job/rollback.h"
#include "coordinator/live_job/checkpoint_file.h"
#include "coordinator/live_job/late_results.h"
#include "coordinator/live_job/stored.h"
#include "coordinator/store/journal_file.h"

#include <string.h>

enum { DAMAGED_NAMED_MAX = 16 /* damaged leases that are named in the log */ };

struct replay {
	struct live_job *job;
	struct replay_progress *progress; /* NULL: nobody watches the progress */
	double elapsed;
	uint64_t batches;
	struct lease_key damaged[DAMAGED_NAMED_MAX]; /* leases of damaged records, to be computed again */
	size_t damaged_count;
};

enum replay_readiness replay_readiness(const struct live_job *job, const struct lease_key *k)
{
	if (k->kind == LEASE_BOOTSTRAP) {
		bool merged = !job->bootstrap || bootstrap_has_lease(job->bootstrap, k->group, k->part);
		return merged ? REPLAY_MERGED : REPLAY_READY;
	}
	if (job->bootstrap)
		return REPLAY_LATE;
	if (canvas_has_lease(job->canvas, k))
		return REPLAY_MERGED;
	struct lease_key previous = *k;
	previous.epoch--;
	bool open = k->epoch <= canvas_complete_rounds(job->canvas) + 1;
	return open && (k->epoch == 0 || canvas_has_lease(job->canvas, &previous)) ? REPLAY_READY : REPLAY_LATE;
}

static int merge_batch(struct replay *r, struct batch *b, struct error *e)
{
	struct live_job *job = r->job;
	uint64_t rounds = live_job_complete_rounds(job);
	int rc = live_job_merge(job, b, e);
	if (rc == -EEXIST || rc == -EAGAIN) /* the file is at fault, not the machine */
		rc = error_prefix(e, -EBADMSG, "a batch out of order");
	live_job_note_times(job, r->elapsed, rounds);
	if (!rc && job->bootstrap && bootstrap_missing_count(job->bootstrap) == 0)
		rc = live_job_prepare(job, job->film_folder, e);
	r->batches++;
	return rc;
}

/* Returns -EPROTO for an undamaged record that another version wrote, so that the journal is not thrown away. */
static int foreign_record_error(const struct replay *r, const char *what, size_t size, struct error *e)
{
	return error_set(
		e, EPROTO,
		"the journal of j%llu has %s of %zu bytes that this version cannot read: another version wrote it",
		(unsigned long long)r->job->id, what, size);
}

/* Like foreign_record_error(), for estimates and counters, where e already says what is wrong. */
static int foreign_note_error(const struct replay *r, int rc, struct error *e)
{
	return rc == -EPROTO ? error_prefix(e, rc, "the journal of j%llu: another version wrote it",
					    (unsigned long long)r->job->id)
			     : rc;
}

static int replay_batch(struct replay *r, const struct journal_item *item, struct error *e)
{
	struct envelope env;
	struct batch batch = {0};
	const unsigned char *payload;
	size_t payload_size;
	int rc = envelope_unpack_frame(&env, FARM__ENVELOPE__BODY_LEASE_RESULT, item->body, item->body_size, &payload,
				       &payload_size, e);
	if (rc)
		return rc == -EBADMSG ? foreign_record_error(r, "a result", item->body_size, e) : rc;
	rc = batch_unpack(&batch, &r->job->plan, env.message->lease_result, payload, payload_size, e);
	if (rc == -EBADMSG)
		rc = foreign_record_error(r, "a result", item->body_size, e);
	if (!rc && item->kind == JOURNAL_BATCH_REPLACEMENT)
		rc = rollback_replay(r->job, item->journal, &batch.key, e);
	if (!rc && item->kind == JOURNAL_MERGED_BATCH) {
		r->job->merged_record_bytes += item->body_size;
		rollback_note_batch(r->job, &batch.key, item->offset, env.message->lease_result->maker);
		batch_fini(&batch);
		envelope_fini(&env);
		return 0;
	}
	enum replay_readiness readiness = rc ? REPLAY_MERGED : replay_readiness(r->job, &batch.key);
	if (readiness == REPLAY_READY)
		rc = merge_batch(r, &batch, e);
	if (readiness == REPLAY_READY && !rc)
		rollback_note_batch(r->job, &batch.key, item->offset, env.message->lease_result->maker);
	else if (readiness == REPLAY_LATE)
		rc = late_results_add(r->job, &batch.key, item->offset, e);
	batch_fini(&batch);
	envelope_fini(&env);
	return rc;
}

static void note_damage(struct replay *r, const struct journal_item *item)
{
	if ((item->kind == JOURNAL_BATCH || item->kind == JOURNAL_BATCH_REPLACEMENT) &&
	    r->damaged_count < DAMAGED_NAMED_MAX)
		r->damaged[r->damaged_count++] = item->lease;
}

static int report_progress(void *user, size_t bytes, struct error *e)
{
	struct replay_progress *p = ((struct replay *)user)->progress;
	if (!p)
		return 0;
	atomic_fetch_add(&p->bytes_read, bytes);
	return atomic_load(&p->stop_requested) ? error_set(e, ECANCELED, "the coordinator stops") : 0;
}

static int replay_record(void *user, const struct journal_item *item, struct error *e)
{
	struct replay *r = user;
	struct live_job *job = r->job;
	struct forecast_look look;
	const unsigned char *body = item->body;
	size_t size = item->body_size;
	int rc = report_progress(r, size, e);
	if (rc)
		return rc;
	if (item->damaged_count) {
		note_damage(r, item);
		return item->kind == JOURNAL_BATCH_REPLACEMENT ? rollback_replay(job, item->journal, &item->lease, e)
							       : 0;
	}
	r->elapsed = item->elapsed;
	switch (item->kind) {
	case JOURNAL_BATCH:
	case JOURNAL_BATCH_REPLACEMENT:
	case JOURNAL_MERGED_BATCH:
		return replay_batch(r, item, e);
	case JOURNAL_FINGERPRINT:
		if (size >= sizeof job->fingerprint)
			return foreign_record_error(r, "a fingerprint", size, e);
		memcpy(job->fingerprint, body, size);
		job->fingerprint[size] = 0;
		return 0;
	case JOURNAL_LOOK:
	case JOURNAL_OLD_LOOK:
		rc = (item->kind == JOURNAL_LOOK ? stored_unpack_look : stored_unpack_old_look)(body, size, &look, e);
		if (rc)
			return foreign_note_error(r, rc, e);
		forecast_add_look(&job->record.looks, &look);
		job->last_stored_look_work = look.work;
		return 0;
	case JOURNAL_COUNTS:
	case JOURNAL_OLD_COUNTS:
		rc = item->kind == JOURNAL_COUNTS ? stored_unpack_counts(body, size, &job->record.counts, e)
						  : stored_unpack_old_counts(body, size, &job->record.counts, e);
		return rc ? foreign_note_error(r, rc, e) : 0;
	default:
		return foreign_record_error(r, "a record", size, e);
	}
}

/* Merges the batches that had to wait for records further on in the file; the others stay in job->late_results. */
static int replay_late(struct replay *r, struct error *e)
{
	struct live_job *job = r->job;
	size_t kept = 0;
	int rc = 0;
	late_results_sort(job);
	for (size_t i = 0; i < job->late_result_count; i++) {
		struct late_result l = job->late_results[i];
		struct journal_item item = {.kind = JOURNAL_BATCH, .offset = l.offset};
		unsigned char *body = NULL;
		enum replay_readiness readiness = rc ? REPLAY_LATE : replay_readiness(job, &l.key);
		if (readiness == REPLAY_READY &&
		    (rc = journal_read_body(job->journal, l.offset, &body, &item.body_size, e)) == 0) {
			item.body = body;
			rc = replay_batch(r, &item, e);
			mem_free(body);
		}
		if (readiness == REPLAY_LATE)
			job->late_results[kept++] = l;
	}
	job->late_result_count = kept;
	return rc;
}

/* Logs which damaged results are to be computed again; those computed since are merged and not named. */
static void log_damage(const struct replay *r, const struct journal_damage *found)
{
	struct live_job *job = r->job;
	char text[400] = "";
	struct text t = {text, sizeof text};
	uint64_t open = 0;
	for (size_t i = 0; i < r->damaged_count; i++) {
		const struct lease_key *k = &r->damaged[i];
		if (replay_readiness(job, k) == REPLAY_MERGED)
			continue;
		text_appendf(&t, "%s%s " LEASE_POSITION_FORMAT, open++ ? ", " : ": ", LEASE_VALUES(k));
	}
	live_job_log(
		job, LOG_SPOOL_FAULT,
		"damaged=%llu waiting=%zu text=\"the journal is damaged: %llu stored records are lost; leases to be computed again%s\"",
		(unsigned long long)found->damaged_count, job->late_result_count, (unsigned long long)found->lost_count,
		*text ? text : ": none");
}

int replay_films(const struct spool *spool, struct live_job *job, struct replay_progress *p, struct error *e)
{
	struct replay r = {.job = job, .progress = p};
	struct journal_damage found;
	char folder[SPOOL_PATH_MAX];
	uint64_t generation = 0;
	spool_job_path(spool, job->id, NULL, folder);
	int rc = checkpoint_load(spool, job, &generation, report_progress, &r, e);
	if (rc && rc != -ENOENT)
		return rc;
	rc = journal_open(&job->journal, folder, job->id, generation, replay_record, &r, &found, e);
	if (rc == -ENOENT) { /* the batches in it can be computed again */
		live_job_log(job, LOG_SPOOL_FAULT, "text=\"%s/journal.%llu is gone: its results are computed again\"",
			     folder, (unsigned long long)generation);
		rc = journal_create(&job->journal, folder, job->id, generation, e);
	}
	if (!rc && job->late_result_count)
		rc = replay_late(&r, e);
	if (rc)
		return rc;
	if (found.lost_count)
		log_damage(&r, &found);
	journal_delete_others(folder, generation);
	job->is_fingerprint_journaled = *job->fingerprint != 0;
	live_job_log(
		job, LOG_JOB_STATE,
		"state=restored batches=%llu rounds=%llu elapsed=%.3f checkpoint=%llu journal=%llu cut=%llu damaged=%llu",
		(unsigned long long)r.batches, (unsigned long long)live_job_complete_rounds(job), job->times.elapsed,
		(unsigned long long)job->checkpoint_bytes, (unsigned long long)journal_bytes(job->journal),
		(unsigned long long)found.cut_bytes, (unsigned long long)found.damaged_count);
	return 0;
}
