/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Carries out the core's answer to an event, action by action: sends leases, revocations and acknowledgements, merges
 * results, prepares jobs after their bootstrap, starts publishing, records changes of state.
 *
 * A result that the core wants merged is first appended to the job's journal (durable_append_result), then added to its
 * films; its acknowledgement waits for the flush (durable_ack). A job that the core has ended is finished later
 * (finish.c).
 *
 * If memory runs out while a result is merged, the process exits: the films may contain half of the result, and
 * nobody was told that it is stored. The next start takes it from the journal or has it computed again. Any other
 * failure of a merge ends the job. A job that cannot be prepared because the disk is full is tried again.
 */
#include "coordinator/jobs/dispatch.h"

#include "common/base/disk.h"
#include "common/base/text.h"
#include "common/plan/plan_text.h"
#include "coordinator/live_job/rollback.h"
#include "coordinator/live_job/incoming.h"
#include "coordinator/live_job/late_results.h"
#include "coordinator/jobs/durable.h"
#include "coordinator/jobs/publish.h"
#include "coordinator/jobs/storage.h"
#include "coordinator/jobs/step.h"
#include "coordinator/jobs/trust.h"

#include <assert.h>
#include <fcntl.h>
#include <string.h>
#include <unistd.h>

/* Stores a new job: id, folder, live job, row. After an error nothing is left, and the submission still belongs to
 * `submission`. */
static int store_submission(struct jobs *jobs, uint64_t id, const struct submission *submission, struct live_job **job,
			    struct error *e)
{
	int rc = ledger_skip_ids(jobs->ledger, id, e); /* before there is a folder (see reconcile.c) */
	if (!rc)
		rc = spool_create_job_folder(jobs->spool, id, e);
	if (!rc)
		rc = live_job_new(job, id, submission->envelope, submission->plan, submission->owner, 0, jobs->spool,
				  e);
	if (!rc && (rc = durable_add_job(jobs, *job, e))) {
		*submission->envelope = (*job)->submission;
		memset(&(*job)->submission, 0, sizeof(*job)->submission);
		live_job_free(*job);
	}
	if (rc) /* files that are left behind belong to no row, and are deleted at the next start */
		spool_delete_job(jobs->spool, id, NULL);
	return rc;
}

static void add_submitted_job(struct jobs *jobs, const struct action *a, const struct incoming *in)
{
	struct submission *submission = in->submission;
	struct live_job *job;
	struct error e;
	const Farm__Submit *m = submission->envelope->message->submit;
	int rc;
	submission->job_id = a->job;
	do
		rc = store_submission(jobs, a->job, submission, &job, &e);
	while (disk_is_full(rc) && storage_evict(jobs));
	if (rc) {
		*in->refusal = e;
		jobs_defer_failure(jobs, a->job, e.text);
		return;
	}
	job->next = jobs->live_jobs;
	jobs->live_jobs = job;
	char plan[PLAN_TEXT_MAX];
	plan_describe(&job->plan, plan, sizeof plan);
	live_job_log(job, LOG_JOB_SUBMIT, "name=%s client=%s owner=%s plan=%s rule=%s",
		     log_quote(job->record.name).text, submission->address,
		     *submission->owner ? submission->owner : "-", log_quote(plan).text,
		     log_quote(submission->epoch_rule).text);
	for (size_t i = 0; i < m->n_notes; i++)
		live_job_log(job, LOG_JOB_NOTE, "text=%s", log_quote(m->notes[i]).text);
	for (size_t i = 0; i < m->n_effects; i++)
		live_job_log(job, LOG_JOB_NOTE, "effect=%s on=%d why=%s", log_quote(m->effects[i]->name).text,
			     (int)m->effects[i]->on, log_quote(m->effects[i]->why).text);
}

static void report_rejection(const struct action *a, const struct incoming *in)
{
	if (in->refusal)
		error_set(in->refusal, EPERM, "%s", *a->text ? a->text : "refused");
}

static void note_job_change(struct jobs *jobs, const struct action *a)
{
	struct live_job *job = jobs_find_live(jobs, a->job);
	if (!job)
		return;
	live_job_log(job,
		     a->state == JOB_FAILED ? LOG_JOB_FAILED
		     : a->state == JOB_DONE ? LOG_JOB_DONE
					    : LOG_JOB_STATE,
		     "state=%s reason=%s rounds=%llu text=%s", job_state_name(a->state),
		     a->end == END_NONE ? "none" : job_end_name(a->end), log_u64_arg(a->rounds),
		     log_quote(a->text).text);
	job->has_ended = job_state_is_end(a->state);
}

void dispatch_prepare(struct jobs *jobs, struct live_job *job)
{
	struct error e = {""};
	int rc = live_job_prepare(job, jobs_film_folder(jobs, &job->plan), &e);
	if (rc && rc != -ENOMEM) {
		if (!job->is_prepare_pending)
			live_job_log(job, LOG_SPOOL_FAULT, "text=%s action=\"it will be tried again\"",
				     log_quote(e.text).text);
		job->is_prepare_pending = true;
		job->retry_at = jobs_now(jobs) + jobs->config.retry_seconds;
		return;
	}
	job->is_prepare_pending = false;
	if (!rc)
		live_job_log(job, LOG_JOB_STATE, "state=prepared b=%.9g beyond=%.3g black=%d",
			     job->bootstrap_result.b_pooled, job->bootstrap_result.overlong_share,
			     (int)job->bootstrap_result.is_black);
	struct event ev = {.kind = EVENT_PREPARED,
			   .job = job->id,
			   .text = e.text,
			   .prepared = {.job = job->id, .ok = rc == 0, .black = job->bootstrap_result.is_black}};
	jobs_defer_event(jobs, &ev);
}

static void write_partials(const struct jobs *jobs, const struct lease_key *k, const struct incoming *in)
{
	for (size_t i = 0; i < in->result->n_tile_sizes; i++) {
		char path[SPOOL_PATH_MAX];
		size_t size;
		const unsigned char *bytes = batch_tile_bytes(in->result, in->payload->bytes, i, &size);
		snprintf(path, sizeof path, "%s/j%llu-e%llu-g%u-p%u-x%u-y%u.exr", jobs->config.partials_folder,
			 log_u64_arg(k->job), log_u64_arg(k->epoch), k->group, k->part, in->batch->tiles[i].x,
			 in->batch->tiles[i].y);
		int fd = disk_open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
		int rc = fd < 0 ? -errno : disk_write_all(fd, bytes, size);
		if (fd >= 0 && disk_close(fd) && !rc)
			rc = -errno;
		if (rc)
			log_event(LOG_SPOOL_FAULT, "path=%s text=%s", log_quote(path).text,
				  log_quote(strerror(-rc)).text);
	}
}

static void merge_result(struct jobs *jobs, const struct action *a, const struct incoming *in)
{
	struct live_job *job = jobs_find_live(jobs, a->job);
	struct error e;
	assert(job && in->batch && !job->is_busy);
	if (jobs->config.partials_folder)
		write_partials(jobs, &a->key, in);
	uint64_t rounds = live_job_complete_rounds(job);
	uint64_t offset = in->stored_offset;
	int rc = in->is_stored ? 0 : durable_append_result(jobs, job, in, &offset, &e);
	if (!rc)
		rc = live_job_merge(job, in->batch, &e);
	if (!rc)
		rollback_note_batch(job, &a->key, offset, in->result->maker);
	if (rc == -ENOMEM) { /* merged by half, and not acknowledged */
		log_event(
			LOG_STOP,
			"text=\"no memory to merge a result: exiting; after a restart all jobs continue from the disk\"");
		_exit(1);
	}
	job->has_overflowed = job->has_overflowed || rc == -ERANGE;
	if (rc)
		jobs_defer_failure(jobs, a->job, e.text);
	trust_count_unverified(job, a);
	live_job_note_times(job, farm_job_elapsed(jobs->farm, a->job, jobs_now(jobs)), rounds);
	log_event(LOG_BATCH_MERGED, "job=j%llu peer=%llu " LEASE_FORMAT "%s", log_u64_arg(a->job), log_u64_arg(a->peer),
		  LEASE_VALUES(&a->key), in->is_stored ? " late=1" : "");
}

static void roll_back(struct jobs *jobs, const struct action *a, const struct incoming *in)
{
	struct live_job *job = jobs_find_live(jobs, a->job);
	assert(job && !job->is_busy && in->rollback);
	rollback_apply(job, in->rollback);
	trust_discount_unverified(job, a->worker_id);
	live_job_log(job, LOG_BATCH_TAKEN_BACK, LEASE_FORMAT " text=%s", LEASE_VALUES(&a->key),
		     log_quote(a->text).text);
}

static void acknowledge_result(struct jobs *jobs, const struct action *a)
{
	const struct live_job *job = jobs_find_live(jobs, a->job);
	const char *name = jobs->peers.peer_name(jobs->peers.user, a->peer);
	if (a->ack == ACK_MERGED || (a->ack == ACK_REPEATED && job)) /* the original result may not be on disk yet */
		durable_ack(jobs, job, a->peer, &a->key, a->ack);
	else
		jobs->peers.acknowledge_result(jobs->peers.user, a->peer, &a->key, a->ack, a->text);
	if (a->ack != ACK_MERGED)
		log_event(a->ack == ACK_REPEATED ? LOG_BATCH_REPEATED
			  : a->ack == ACK_NOTED	 ? LOG_BATCH_NOTED
						 : LOG_BATCH_REFUSED,
			  "job=j%llu peer=%llu worker=%s " LEASE_FORMAT " text=%s", log_u64_arg(a->job),
			  log_u64_arg(a->peer), log_quote(name ? name : "?").text, LEASE_VALUES(&a->key),
			  log_quote(a->text).text);
}

static void send_lease(struct jobs *jobs, const struct action *a)
{
	struct live_job *job = jobs_find_live(jobs, a->job);
	if (!jobs->peers.peer_name(jobs->peers.user, a->peer) || !job ||
	    late_results_claim_lease(job, &a->key, a->peer))
		return;
	live_job_count_worker(job, a->peer);
	jobs->peers.send_lease(jobs->peers.user, a->peer, job, &a->key, a->starts_from_seeds);
	log_event(LOG_LEASE_GRANTED, "job=j%llu peer=%llu " LEASE_FORMAT, log_u64_arg(a->job), log_u64_arg(a->peer),
		  LEASE_VALUES(&a->key));
}

static void revoke_lease(struct jobs *jobs, const struct action *a)
{
	jobs->peers.revoke_lease(jobs->peers.user, a->peer, &a->key);
	log_event(LOG_LEASE_TAKEN_BACK, "job=j%llu peer=%llu " LEASE_FORMAT, log_u64_arg(a->job), log_u64_arg(a->peer),
		  LEASE_VALUES(&a->key));
}

static void close_peer(struct jobs *jobs, const struct action *a)
{
	live_jobs_drop_waiting(jobs->live_jobs, a->peer); /* the worker may return under the same number */
	jobs->peers.dismiss_peer(jobs->peers.user, a->peer, a->text);
}

void dispatch_update(struct jobs *jobs, const struct update *u, const struct incoming *in)
{
	for (size_t i = 0; i < u->count; i++) {
		const struct action *a = &u->actions[i];
		switch (a->kind) {
		case ACTION_CANCELLED:
		case ACTION_ROUND_DONE:
		case ACTION_JOB_FORGOTTEN:
			break;
		case ACTION_SUBMITTED:
			add_submitted_job(jobs, a, in);
			break;
		case ACTION_REJECTED:
			report_rejection(a, in);
			break;
		case ACTION_SEND_LEASE:
			send_lease(jobs, a);
			break;
		case ACTION_REVOKE_LEASE:
			revoke_lease(jobs, a);
			break;
		case ACTION_MERGE_BATCH:
			merge_result(jobs, a, in);
			break;
		case ACTION_ACKNOWLEDGE:
			acknowledge_result(jobs, a);
			break;
		case ACTION_BOOTSTRAP_DONE:
			dispatch_prepare(jobs, jobs_find_live(jobs, a->job));
			break;
		case ACTION_ESTIMATE_ERROR:
			publish_start(jobs, jobs_find_live(jobs, a->job), PUBLISH_ERROR_ONLY, a->rounds);
			break;
		case ACTION_PUBLISH:
			publish_start(jobs, jobs_find_live(jobs, a->job), PUBLISH_RESULT, a->rounds);
			break;
		case ACTION_JOB_CHANGED:
			note_job_change(jobs, a);
			break;
		case ACTION_ROLL_BACK_EPOCH:
			roll_back(jobs, a, in);
			break;
		case ACTION_RESTART_CHAINS:
			trust_note_chain_restart(jobs, a);
			break;
		case ACTION_WRONG_RESULT:
			trust_log_wrong_result(jobs, a);
			break;
		case ACTION_QUARANTINE:
			trust_record_quarantine(jobs, a);
			break;
		case ACTION_CLOSE_PEER:
			close_peer(jobs, a);
			break;
		}
	}
}
