/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Passes results of leases to the core, at once or when no thread reads the job's films any more.
 *
 * A result is unpacked and checked, room for its record is reserved, and the core decides: it is merged, noted,
 * repeated or refused. A result that the core would merge while the films are being read waits, and comes here again
 * afterwards.
 *
 * Failures: a key that cannot be read is a fault of the peer, which is disconnected. Values out of range (-ERANGE),
 * which may be the same for any worker, count as a failed lease. Other contents that fail the checks go to the core
 * as invalid, with the reason. If there is no room, in memory, on the disk or among the results that wait, a result
 * is refused and its lease handed out again. A failure that may be the fault of the job's files counts once these
 * have been read.
 */
#include "coordinator/jobs/results.h"

#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/core/answer.h"
#include "coordinator/core/doubt.h"
#include "coordinator/live_job/rollback.h"
#include "coordinator/live_job/digest.h"
#include "coordinator/live_job/incoming.h"
#include "coordinator/jobs/durable.h"
#include "coordinator/jobs/files.h"
#include "coordinator/jobs/step.h"

/* Refuses a result through no fault of the worker. Its lease is computed again. */
static void refuse_result(struct jobs *jobs, uint64_t peer, const struct lease_key *k, const char *why)
{
	struct event ev = {.kind = EVENT_LEASE_RETURNED, .peer = peer, .job = k->job, .lease = {.key = *k}};
	jobs->peers.acknowledge_result(jobs->peers.user, peer, k, ACK_REFUSED, why);
	jobs_step(jobs, &ev);
}

static void fail_result(struct jobs *jobs, struct live_job *job, uint64_t peer, const struct lease_key *k,
			const char *why)
{
	const char *name = jobs->peers.peer_name(jobs->peers.user, peer);
	struct event ev = {.kind = EVENT_LEASE_FAILED, .peer = peer, .job = k->job, .text = why, .lease = {.key = *k}};
	live_job_log(job, LOG_LEASE_FAILED, "worker=%s own=0 text=%s " LEASE_FORMAT, log_quote(name ? name : "?").text,
		     log_quote(why).text, LEASE_VALUES(k));
	jobs->peers.acknowledge_result(jobs->peers.user, peer, k, ACK_REFUSED, why);
	jobs_step(jobs, &ev);
}

static void handle_result(struct jobs *jobs, uint64_t peer, const Farm__LeaseResult *m, struct buf *payload)
{
	struct event ev = {.kind = EVENT_BATCH, .peer = peer, .lease = {.is_valid = true}};
	struct error e = {""};
	struct batch batch = {0};
	if (lease_key_from_wire(m->key, &ev.lease.key, &e)) {
		jobs->peers.fault_peer(jobs->peers.user, peer, e.text);
		return;
	}
	ev.job = ev.lease.key.job;
	struct live_job *job = jobs_find_live(jobs, ev.job);
	int rc = job ? batch_unpack(&batch, &job->plan, m, payload->bytes, payload->size, &e) : 0;
	if (job && !rc && batch.state_count && !m->states_digest.len)
		rc = error_set(&e, EBADMSG, "chain states without a digest");
	if (job && !rc && farm_lease_is_verified(jobs->farm, &ev.lease.key))
		rc = digest_batch(&batch, &ev.lease.digest, &e);
	if (job && !rc && job->canvas && batch.key.kind == LEASE_RENDER)
		rc = canvas_check_range(job->canvas, &batch, &e);
	if (rc == -ERANGE) { /* treated as a failed lease, because the results of all workers may be like that */
		fail_result(jobs, job, peer, &ev.lease.key, e.text);
		batch_fini(&batch);
		return;
	}
	struct peer_status peer_info;
	struct worker_status worker;
	Farm__LeaseResult stored = *m;
	Farm__Maker maker;
	farm__maker__init(&maker);
	bool is_known = farm_peer_status(jobs->farm, peer, &peer_info) &&
			farm_worker_status(jobs->farm, peer_info.worker_id, &worker);
	if (is_known) {
		maker.name = text_unconst(worker.name);
		maker.certificate = text_unconst(worker.certificate);
		maker.home = text_unconst(worker.home);
		maker.restarts = worker.restarts;
	}
	stored.maker = is_known ? &maker : NULL;
	ev.lease.is_valid = rc == 0;
	ev.text = e.text;
	struct incoming in = {.batch = &batch, .result = &stored, .payload = payload};
	/* No room for the result, in memory or on the disk. */
	if (rc == -ENOMEM || (job && ev.lease.is_valid && durable_reserve_result(jobs, job, &in, &e)))
		refuse_result(jobs, peer, &ev.lease.key, e.text);
	else
		jobs_step_with_data(jobs, &ev, &in);
	batch_fini(&batch);
	mem_free(in.frame);
}

static bool has_capacity(const struct jobs *jobs, const struct buf *payload)
{
	uint64_t bytes = payload->capacity;
	for (const struct live_job *job = jobs->live_jobs; job; job = job->next)
		bytes += job->waiting_bytes;
	return bytes <= jobs->config.max_waiting_bytes;
}

/* Keeps a result that arrives while the films are in use, if the core would merge it: one for each lease that its
 * worker holds, and one for a lease that the worker does not hold. */
static void defer_result(struct jobs *jobs, struct live_job *job, uint64_t peer, const struct lease_key *k,
			 struct envelope *env, struct buf *payload)
{
	struct event ev = {
		.kind = EVENT_BATCH_DELIVERED, .peer = peer, .job = k->job, .lease = {.key = *k, .is_valid = true}};
	enum farm_delivery awaited = answer_judge_delivery(jobs->farm, peer, k);
	const struct waiting_message *w = awaited == DELIVERY_OPEN ? live_job_find_waiting(job, k) : NULL;
	if (w && w->peer == peer) /* the acknowledgement of the waiting result will do for this one, too */
		return;
	if (awaited == DELIVERY_REFUSED)
		ev.kind = EVENT_BATCH;
	else if (w || !has_capacity(jobs, payload) || !live_job_enqueue_message(job, peer, k, env, payload, false)) {
		refuse_result(jobs, peer, k,
			      w ? "another worker's result of this lease is waiting"
				: "no room for more waiting results");
		return;
	}
	jobs_step(jobs, &ev);
}

/* Logs a failed lease. holds_lease: the worker holds the lease and refuses its current states; otherwise no maker is
 * named.
 */
static void log_failure(const struct jobs *jobs, const char *from, struct live_job *job, const Farm__LeaseFailed *f,
			const struct lease_key *k, const char *text, bool holds_lease)
{
	struct log_value name = log_quote(from ? from : "?"), quoted_text = log_quote(text);
	if (f->bad_states)
		live_job_log(job, LOG_LEASE_FAILED, "states_of=%s refused_by=%s text=%s " LEASE_FORMAT,
			     log_quote(holds_lease ? doubt_maker_name(jobs->farm, k) : "?").text, name.text,
			     quoted_text.text, LEASE_VALUES(k));
	else
		live_job_log(job, LOG_LEASE_FAILED, "worker=%s own=%d text=%s " LEASE_FORMAT, name.text, f->own,
			     quoted_text.text, LEASE_VALUES(k));
}

static void handle_lease_failed(struct jobs *jobs, uint64_t peer, const Farm__LeaseFailed *f)
{
	struct error e;
	char text[1024];
	struct blob_hash states = {{0}};
	struct event ev = {.kind = *f->text ? EVENT_LEASE_FAILED : EVENT_LEASE_RETURNED, .peer = peer, .text = text};
	/* Removes control characters: the text may contain parts of a scene. */
	text_copy(text, sizeof text, f->text);
	text_clean(text);
	if (lease_key_from_wire(f->key, &ev.lease.key, &e) ||
	    (f->bad_states && chain_states_digest_from_wire(&f->states_digest, &states, &e))) {
		jobs->peers.fault_peer(jobs->peers.user, peer, "an invalid key or digest of a failed lease");
		return;
	}
	ev.job = ev.lease.key.job;
	struct live_job *job = jobs_find_live(jobs, ev.job);
	ev.lease.is_worker_at_fault = f->own;
	ev.lease.is_memory_full = f->later;
	ev.lease.has_bad_states = f->bad_states;
	ev.lease.has_outdated_states = f->bad_states && !(job && live_job_states_match(job, &ev.lease.key, &states));
	bool blamed = f->own || f->bad_states;
	if (job && *f->text && !blamed && answer_failure_counts(jobs->farm, peer, &ev.lease.key) &&
	    !files_are_intact(jobs, job)) { /* the spool's fault, not the worker's */
		ev.kind = EVENT_LEASE_RETURNED;
		text[0] = 0;
	}
	struct rollback rollback = {0};
	bool holds_lease = answer_judge_delivery(jobs->farm, peer, &ev.lease.key) == DELIVERY_AWAITED &&
			   !ev.lease.has_outdated_states; /* otherwise no batch is read for it */
	/* Failures with `later` (memory is full) may come every few seconds: the status shows them, but they are not
	 * logged. */
	if (job && *text && !f->later)
		log_failure(jobs, jobs->peers.peer_name(jobs->peers.user, peer), job, f, &ev.lease.key, text,
			    holds_lease);
	if (job && *text && f->bad_states && holds_lease && !job->is_busy && !jobs->is_stepping &&
	    journal_write(job->journal, &e) == 0)
		ev.lease.can_roll_back = rollback_read(job, job->journal, &ev.lease.key, &rollback, &e) == 0;
	if (ev.lease.can_roll_back)
		jobs_step_with_data(jobs, &ev, &(struct incoming){.rollback = &rollback});
	else
		jobs_step(jobs, &ev);
	rollback_fini(&rollback);
}

/* Has the job's files read, once, before a failure counts that the spool may be to blame for. Returns false if they
 * have been read. */
static bool must_await_files(struct jobs *jobs, struct live_job *job, bool *checked)
{
	if (*checked)
		return false;
	const uint64_t id = job->id;
	bool reading = files_are_being_read(jobs, job); /* perhaps since before the failure */
	if (!reading)
		files_reread(jobs, job);
	*checked = !reading;
	job = jobs_find_live(jobs, id);
	return job && files_are_being_read(jobs, job);
}

/* Handles a failed lease. Refused states are handled when no thread reads the films. No file is read for a failure
 * that does not count, since anybody can send many of them. checked: as in struct waiting_message. */
static void handle_failure(struct jobs *jobs, uint64_t peer, struct envelope *env, struct buf *payload, bool checked)
{
	const Farm__LeaseFailed *m = env->message->lease_failed;
	struct live_job *job = m->key ? jobs_find_live(jobs, m->key->job) : NULL;
	struct lease_key k;
	struct error e;
	bool waits = false;
	if (job && lease_key_from_wire(m->key, &k, &e) == 0 && answer_failure_counts(jobs->farm, peer, &k))
		waits = m->bad_states ? job->is_busy : *m->text && !m->own && must_await_files(jobs, job, &checked);
	if (!waits) {
		if (jobs->peers.peer_name(jobs->peers.user, peer))
			handle_lease_failed(jobs, peer, m);
	} else if (!has_capacity(jobs, payload) || !live_job_enqueue_message(job, peer, &k, env, payload, checked)) {
		refuse_result(jobs, peer, &k, "no room for more waiting results");
	}
}

void results_handle_waiting(struct jobs *jobs, struct waiting_message *w)
{
	if (w->envelope.message->body_case == FARM__ENVELOPE__BODY_LEASE_FAILED)
		handle_failure(jobs, w->peer, &w->envelope, &w->payload, w->has_files_checked);
	else
		results_handle(jobs, w->peer, &w->envelope, &w->payload);
}

void results_release_peer(struct jobs *jobs, uint64_t peer)
{
	for (struct live_job *job = jobs->live_jobs; job;) {
		struct waiting_message *w = live_job_pop_failure(job, peer);
		if (w) {
			handle_failure(jobs, peer, &w->envelope, &w->payload, true);
			waiting_message_free(w);
		}
		job = w ? jobs->live_jobs : job->next; /* the list may have changed */
	}
	live_jobs_drop_waiting(jobs->live_jobs, peer);
}

void results_handle(struct jobs *jobs, uint64_t peer, struct envelope *env, struct buf *payload)
{
	if (env->message->body_case == FARM__ENVELOPE__BODY_LEASE_FAILED) {
		handle_failure(jobs, peer, env, payload, false);
		return;
	}
	const Farm__LeaseResult *m = env->message->lease_result;
	struct live_job *job = m->key ? jobs_find_live(jobs, m->key->job) : NULL;
	struct lease_key k;
	struct error e;
	if (job && job->is_busy && lease_key_from_wire(m->key, &k, &e) == 0)
		defer_result(jobs, job, peer, &k, env, payload);
	else
		handle_result(jobs, peer, m, payload);
}
