/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/jobs/late_feed.h"

#include "common/base/mem.h"
#include "coordinator/live_job/digest.h"
#include "coordinator/live_job/incoming.h"
#include "coordinator/live_job/late_results.h"
#include "coordinator/jobs/step.h"

/* Gives up a stored result that has been damaged meanwhile or is dropped: if the core had given its lease to a
 * worker, the lease is open again. */
static void drop_result(struct jobs *jobs, struct live_job *job, const struct late_result *l, const char *why)
{
	struct event ev = {.kind = EVENT_LEASE_RETURNED, .peer = l->peer, .job = job->id, .lease = {.key = l->key}};
	live_job_log(job, LOG_SPOOL_FAULT, "text=%s", log_quote(why).text);
	if (l->peer)
		jobs_step(jobs, &ev);
}

/* Gives a stored result to the core, which decides whether it counts. */
static int offer_result(struct jobs *jobs, const struct live_job *job, const struct late_result *l, struct error *e)
{
	struct event ev = {.kind = EVENT_STORED_BATCH, .job = job->id, .lease = {.key = l->key, .is_valid = true}};
	struct envelope env;
	struct batch batch = {0};
	struct buf copy = {0};
	unsigned char *body;
	const unsigned char *payload;
	size_t size, payload_size;
	int rc = journal_read_body(job->journal, l->offset, &body, &size, e);
	if (rc)
		return rc;
	rc = envelope_unpack_frame(&env, FARM__ENVELOPE__BODY_LEASE_RESULT, body, size, &payload, &payload_size, e);
	if (rc) {
		mem_free(body);
		return rc;
	}
	rc = batch_unpack(&batch, &job->plan, env.message->lease_result, payload, payload_size, e);
	if (!rc && farm_lease_is_verified(jobs->farm, &l->key))
		rc = digest_batch(&batch, &ev.lease.digest, e);
	copy.limit = payload_size;
	if (!rc && !buf_append(&copy, payload, payload_size))
		rc = error_set(e, ENOMEM, "no memory for a result");
	if (!rc) {
		const struct incoming in = {.batch = &batch,
					    .result = env.message->lease_result,
					    .payload = &copy,
					    .is_stored = true,
					    .stored_offset = l->offset};
		jobs_step_with_data(jobs, &ev, &in);
	}
	buf_fini(&copy);
	batch_fini(&batch);
	envelope_fini(&env);
	mem_free(body);
	return rc;
}

bool late_results_drop_all(struct jobs *jobs, uint64_t id)
{
	struct live_job *job;
	while ((job = jobs_find_live(jobs, id)) && job->late_result_count) {
		struct late_result l = job->late_results[--job->late_result_count];
		drop_result(jobs, job, &l, "a waiting result in the journal is computed again");
	}
	return job != NULL;
}

/* Offers the first stored result of the job that fits. Returns true if a step was made, after which other results may
 * fit, and any job may be gone. */
static bool feed_one(struct jobs *jobs, struct live_job *job)
{
	for (size_t i = 0; i < job->late_result_count; i++) {
		struct late_result l = job->late_results[i];
		struct error e;
		const uint64_t id = job->id;
		enum replay_readiness readiness = replay_readiness(job, &l.key);
		if (readiness == REPLAY_LATE)
			continue;
		int rc = readiness == REPLAY_READY ? offer_result(jobs, job, &l, &e) : 0;
		if (rc == -ENOMEM) /* try again later */
			return false;
		if (!rc && !jobs_find_live(jobs, id)) /* a sum left the films' range, which ended the job */
			return true;
		/* The core waits for an estimate of the error. */
		if (!rc && replay_readiness(job, &l.key) != REPLAY_MERGED)
			continue;
		l = job->late_results[i];
		late_results_remove(job, i);
		if (rc)
			drop_result(jobs, job, &l, e.text);
		return true;
	}
	return false;
}

void late_results_feed(struct jobs *jobs)
{
	if (jobs->is_feeding_late_results || jobs->is_stepping || jobs->is_stopping)
		return;
	jobs->is_feeding_late_results = true;
	for (struct live_job *job = jobs->live_jobs; job;) {
		bool fed = job->late_result_count && !job->is_busy && !job->has_ended && feed_one(jobs, job);
		job = fed ? jobs->live_jobs : job->next; /* the list may have changed */
	}
	jobs->is_feeding_late_results = false;
}
