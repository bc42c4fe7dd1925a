/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Makes a live job from its row in the ledger: submission, plan and record; and tells the core of it.
 *
 * restore_live_job unpacks the row, takes references to the scene files and takes from the record what the submission
 * does not contain. Once its films are read, restore_tell_core tells the core which epoch of each group and part comes
 * next, and who made the states that it starts from.
 *
 * A submission or plan that cannot be unpacked is -EPROTO if another version accepted the job, otherwise -EBADMSG;
 * the caller decides what happens to the job. Nothing is left behind: references to files are released.
 */
#include "coordinator/jobs/restore.h"

#include "common/base/mem.h"
#include "common/base/text.h"
#include "common/base/version.h"
#include "coordinator/live_job/incoming.h"
#include "coordinator/jobs/step.h"
#include "coordinator/jobs/trust.h"

#include <string.h>

static uint64_t next_epoch(const struct live_job *job, uint32_t group, uint32_t part)
{
	if (job->bootstrap)
		return bootstrap_has_lease(job->bootstrap, group, part);
	struct lease_key k = {.job = job->id,
			      .kind = LEASE_RENDER,
			      .group = group,
			      .part = part,
			      .epoch = canvas_complete_rounds(job->canvas)};
	for (struct lease_key before = k; k.epoch > 0; k.epoch--) { /* a batch that was taken back may be missing */
		before.epoch = k.epoch - 1;
		if (canvas_has_lease(job->canvas, &before))
			break;
	}
	while (k.epoch < job->plan.rounds && canvas_has_lease(job->canvas, &k))
		k.epoch++;
	return k.epoch;
}

const char *restore_hold_text(const char *holder, char text[256])
{
	text_print(text, 256, "held by %s", holder);
	return text;
}

int restore_tell_core(struct jobs *jobs, const struct live_job *job, const char *holder, uint64_t tag, struct error *e)
{
	uint32_t slots = job->plan.groups * job->plan.parts;
	uint64_t *next = mem_alloc(slots, sizeof *next);
	struct event_join *makers = mem_alloc(slots, sizeof *makers);
	if (!next || !makers) {
		mem_free(next);
		mem_free(makers);
		return error_set(e, ENOMEM, "no memory for a job");
	}
	for (uint32_t i = 0; i < slots; i++) {
		const struct live_job_maker *m = &job->makers[i];
		next[i] = next_epoch(job, i / job->plan.parts, i % job->plan.parts);
		makers[i] = (struct event_join){.name = *m->name ? m->name : NULL,
						.certificate = m->certificate,
						.home = m->home,
						.restarts = m->restarts};
		log_event(LOG_BATCH_RESTORED, "job=j%llu kind=%s group=%u part=%u epochs=%llu",
			  (unsigned long long)job->id, lease_kind_name(job->bootstrap ? LEASE_BOOTSTRAP : LEASE_RENDER),
			  i / job->plan.parts, i % job->plan.parts, (unsigned long long)next[i]);
	}
	char text[256];
	struct event ev = {
		.kind = EVENT_RESTORE,
		.tag = tag,
		.restore = {.job = job->id,
			    .submit = {.plan = &job->plan,
				       .name = job->record.name,
				       .priority = job->record.priority,
				       .is_mixed = live_job_submission(job)->mixed,
				       .owner = job->record.owner,
				       .verify_fraction = trust_verify_fraction(jobs, live_job_submission(job))},
			    .fingerprint = job->fingerprint,
			    .kind = job->bootstrap ? LEASE_BOOTSTRAP : LEASE_RENDER,
			    .next_epochs = next,
			    .makers = makers,
			    .is_black = job->bootstrap_result.is_black,
			    .elapsed = job->times.elapsed,
			    .first_round_at = job->times.first_round_at,
			    .last_round_end = job->times.last_round_end,
			    .looks = &job->record.looks,
			    .counts = job->record.counts}};
	int rc = jobs_try_step(jobs, &ev, &(struct incoming){0}, e);
	if (rc && !tag) /* without a tag the core refuses for no other reason */
		rc = error_set(e, ENOMEM, "no memory for a job");
	mem_free(next);
	mem_free(makers);
	if (!rc && *holder) {
		ev = (struct event){
			.kind = EVENT_HOLD, .job = job->id, .hold = HOLD_USER, .text = restore_hold_text(holder, text)};
		jobs_step(jobs, &ev);
	}
	return rc;
}

static int hold_blobs(struct jobs *jobs, const Farm__Submit *m, struct error *e)
{
	for (size_t i = 0; i < m->n_files; i++) {
		struct blob_hash h = file_hash_from_wire(m->files[i]);
		int rc = blob_hold_expected(jobs->blobs, &h, e);
		if (!rc)
			continue;
		while (i-- > 0) {
			h = file_hash_from_wire(m->files[i]);
			blob_release(jobs->blobs, &h);
		}
		return rc;
	}
	return 0;
}

int restore_record(const struct jobs *jobs, uint64_t id, struct job_record *r, bool *exists, struct error *e)
{
	int rc = ledger_read_record(jobs->ledger, id, r, e);
	*exists = rc == 0;
	return rc == -ENOENT || rc == -EBADMSG ? 0 : rc;
}

/* Takes what the submission does not contain: priority, number of extensions, and the record of the end before an
 * extension, since that image exists until there is a new one. */
static int apply_record(const struct jobs *jobs, const struct ledger_job *j, struct live_job *job, struct error *e)
{
	job->record.priority = j->priority;
	job->record.extended = j->extended;
	struct job_record *r = mem_alloc(1, sizeof *r);
	bool exists = false;
	int rc = r ? 0 : error_set(e, ENOMEM, "no memory for a job");
	if (!rc && (j->extended || j->end_time > 0))
		rc = restore_record(jobs, job->id, r, &exists, e);
	if (!rc && exists)
		job->record.has_result = r->has_result;
	if (!rc && exists && r->has_result && strcmp(r->state, job_state_name(JOB_DONE)) == 0)
		job->earlier_record = r;
	else
		mem_free(r);
	return rc;
}

/* Explains why plan or submission cannot be read: another version wrote it, or it is damaged. */
static int unreadable_error(const struct ledger_job *j, int rc, struct error *e)
{
	if (rc != -EBADMSG && rc != -EINVAL)
		return rc;
	if (strcmp(j->version, HSLT_VERSION) == 0)
		return error_prefix(e, -EBADMSG, "its submission or plan");
	return error_prefix(e, -EPROTO, "it was submitted to version %.40s of the coordinator, and this is %s",
			    j->version, HSLT_VERSION);
}

static int make_live_job(struct jobs *jobs, const struct ledger_job *j, struct live_job **job, struct error *e)
{
	struct envelope submit, info;
	struct plan plan;
	const unsigned char *payload;
	size_t size;
	int rc = envelope_unpack_frame(&info, FARM__ENVELOPE__BODY_JOB_INFO, j->plan, j->plan_size, &payload, &size, e);
	if (rc)
		return unreadable_error(j, rc, e);
	rc = info.message->job_info->plan ? plan_from_wire(info.message->job_info->plan, &plan, e)
					  : error_set(e, EBADMSG, "there is no plan");
	envelope_fini(&info);
	if (!rc)
		rc = envelope_unpack_frame(&submit, FARM__ENVELOPE__BODY_SUBMIT, j->submission, j->submission_size,
					   &payload, &size, e);
	if (rc)
		return unreadable_error(j, rc, e);
	rc = hold_blobs(jobs, submit.message->submit, e);
	if (!rc && (rc = live_job_new(job, j->id, &submit, &plan, j->owner, j->submitted, jobs->spool, e)))
		live_job_release_blobs(submit.message->submit, jobs->blobs);
	envelope_fini(&submit);
	return rc;
}

void restore_drop_job(struct jobs *jobs, struct live_job *job)
{
	live_job_release_blobs(live_job_submission(job), jobs->blobs);
	live_job_free(job);
}

int restore_live_job(struct jobs *jobs, const struct ledger_job *j, struct live_job **job, struct error *e)
{
	int rc = make_live_job(jobs, j, job, e);
	if (rc)
		return rc;
	rc = apply_record(jobs, j, *job, e);
	if (rc)
		restore_drop_job(jobs, *job);
	else
		(*job)->film_folder = jobs_film_folder(jobs, &(*job)->plan);
	return rc;
}
