/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A client's side of a session: submit, list, watch; fetch.c and control.c have the rest.
 *
 * A submission waits in the session until its files have arrived (upload.h), and then goes to the core, whose answer
 * is sent to the client. A client sees only its own jobs, by the name in its certificate; an operator sees all, and
 * so does everybody without TLS. A client that watches a job is sent its status whenever it has changed and the
 * previous one has been read.
 *
 * A submission that is refused, or exceeds its owner's quota, is answered with a sentence, and the client may submit
 * another. If there is no room for files, submissions whose clients send nothing give way. An invalid message is
 * answered by Fault, and the connection ends.
 */
#include "coordinator/peers/client.h"

#include "common/base/mem.h"
#include "common/base/text.h"
#include "common/plan/plan_text.h"
#include "coordinator/live_job/incoming.h"
#include "coordinator/jobs/listing.h"
#include "coordinator/jobs/storage.h"
#include "coordinator/jobs/step.h"
#include "coordinator/jobs/trust.h"
#include "coordinator/peers/client_answers.h"
#include "coordinator/peers/control.h"
#include "coordinator/peers/fetch.h"
#include "coordinator/peers/upload.h"
#include "coordinator/peers/worker_list.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Limit on the bytes of all submissions that wait for files. */
enum { CHUNK_BYTES = 1 << 20, PACE_BYTES = CHUNK_BYTES, SUBMIT_BYTES_MAX = 1 << 28 };

static void answer_submit(struct session *p, uint64_t job, const char *refusal, const struct upload *u)
{
	char text[1024] = "", plan[PLAN_TEXT_MAX + 200] = "";
	struct blob_hash *hashes = NULL;
	ProtobufCBinaryData *list = NULL;
	struct job_view v;
	text_copy(text, sizeof text, refusal);
	if (u) {
		plan_describe(&u->plan, plan, PLAN_TEXT_MAX);
		size_t n = strlen(plan);
		snprintf(plan + n, sizeof plan - n, "%s%s", *u->epoch_rule ? "; " : "", u->epoch_rule);
	}
	if (u && !job) {
		hashes = mem_alloc(u->missing_count, sizeof *hashes);
		list = mem_alloc(u->missing_count, sizeof *list);
	}
	Farm__SubmitAnswer answer =
		MESSAGE(submit_answer, .job = job, .refusal = text, .plan = plan,
			.submitted = job && jobs_get_view(p->jobs, job, &v) ? v.record.submitted : 0);
	if (hashes && list) {
		answer.n_missing = upload_missing_hashes(u, hashes);
		for (size_t i = 0; i < answer.n_missing; i++)
			list[i] = (ProtobufCBinaryData){BLOB_HASH_SIZE, hashes[i].bytes};
		answer.missing = list;
	}
	conn_send(p->conn, ENVELOPE_OF(SUBMIT_ANSWER, submit_answer, &answer), NULL, 0);
	mem_free(hashes);
	mem_free(list);
}

void client_abort_upload(struct session *p)
{
	if (p->upload)
		upload_free(p->upload);
	p->upload = NULL;
	p->peers->submit_message_bytes -= p->submit_message_bytes;
	p->submit_message_bytes = 0;
	conn_set_limits(p->conn, (struct frame_limits){SESSION_HEADER_MAX, 0});
}

static void refuse_upload(struct session *p, const struct error *e)
{
	answer_submit(p, 0, e->text, NULL);
	client_abort_upload(p);
}

static int check_quota(const struct session *p, struct error *e)
{
	if (p->tls_peer.role == TLS_OPERATOR)
		return 0;
	return jobs_check_quota(p->jobs, p->tls_peer.name, 0, client_uploading_bytes(p), &p->upload->plan,
				p->upload->submission.message->submit, e);
}

/* Checks whether the job could be stored if all other jobs were over, since otherwise it would be held forever, and
 * other jobs with it; and whether memory has room for its chain states, supposing that workers send the longest
 * possible. */
static int check_capacity(const struct session *p, struct error *e)
{
	uint64_t bytes = canvas_bytes(&p->upload->plan) + upload_file_bytes(p->upload),
		 states = chain_states_max_bytes(&p->upload->plan);
	if (states > p->jobs->config.max_state_bytes)
		return error_set(e, ENOMEM,
				 "the states of its %u chains could need %.3g MB of the coordinator's memory; the "
				 "limit is %.3g MB: fewer --chains, or a smaller --max-depth",
				 p->upload->plan.chains, 1e-6 * (double)states,
				 1e-6 * (double)p->jobs->config.max_state_bytes);
	int rc = spool_check_capacity(p->jobs->spool, bytes, e);
	return rc ? rc : storage_check_fits(p->jobs, bytes, e);
}

/* Gives the submission, whose blobs have all arrived, to the core, and answers the client. */
static void submit_job(struct session *p)
{
	const Farm__Submit *m = p->upload->submission.message->submit;
	char name[128];
	struct error e;
	/* Checked again, because other jobs may have been submitted while its files arrived. */
	if (check_quota(p, &e)) {
		refuse_upload(p, &e);
		return;
	}
	text_copy(name, sizeof name, m->name);
	struct event ev = {.kind = EVENT_SUBMIT,
			   .tag = p->id,
			   .submit = {.plan = &p->upload->plan,
				      .name = name,
				      .priority = m->priority,
				      .owner = p->tls_peer.name,
				      .is_mixed = m->mixed,
				      .verify_fraction = trust_verify_fraction(p->jobs, m)}};
	struct submission submission = {.envelope = &p->upload->submission,
					.plan = &p->upload->plan,
					.epoch_rule = p->upload->epoch_rule,
					.owner = p->tls_peer.name,
					.address = p->address};
	int rc = jobs_try_step(p->jobs, &ev, &(struct incoming){.submission = &submission}, &e);
	answer_submit(p, rc ? 0 : submission.job_id, e.text, rc ? NULL : p->upload);
	client_abort_upload(p);
}

static void on_lookup_idle(uv_idle_t *h);

/* Looks for the submission's files in the store, where existing ones are read first, and asks the client for the
 * missing ones. */
static void look_up_files(struct session *p)
{
	struct error e;
	int rc = upload_look_up_files(p->upload, p->jobs, &e);
	if (rc == -EAGAIN)
		uv_idle_start(&p->peers->lookup_idle, on_lookup_idle);
	if (rc == -EAGAIN || rc == -EINPROGRESS)
		return;
	if (!rc && p->upload->missing_count == 0) {
		submit_job(p);
		return;
	}
	if (rc || check_quota(p, &e)) {
		refuse_upload(p, &e);
		return;
	}
	conn_set_limits(p->conn, (struct frame_limits){SESSION_HEADER_MAX, CHUNK_BYTES});
	p->upload->pace.progress_at = jobs_now(p->jobs);
	answer_submit(p, 0, "", p->upload);
}

/* Continues one submission in each turn of the loop; the submissions take turns. */
static void on_lookup_idle(uv_idle_t *h)
{
	struct peers *s = h->data;
	struct session *next = NULL;
	for (struct session *p = LIST_FIRST(&s->sessions); p; p = LIST_NEXT(p, next))
		if (p->state == SESSION_CLIENT && p->upload && p->upload->is_lookup_pending &&
		    (!next || p->turn_number < next->turn_number))
			next = p;
	if (!next) {
		uv_idle_stop(h);
		return;
	}
	next->turn_number = ++s->last_turn_number;
	look_up_files(next);
}

/* Whether the client has sent less than PACE_BYTES bytes for twice the time within which a frame must be complete. */
static bool has_stalled(const struct session *p)
{
	return !p->upload->flush && jobs_now(p->jobs) - p->upload->pace.progress_at > 2 * p->jobs->config.stall_seconds;
}

/* Makes room for the files of a submission by refusing another one. The submission that has been idle longest gives
 * way; if none is idle, the latest of those that began after `begun_at` and have received something. So no submission
 * keeps room by waiting, and later submissions take no room from those that are halfway. begun: when the submission
 * in need began; INFINITY if nothing of it has arrived yet, in which case only idle ones give way. Returns false if
 * none gives way. */
static bool evict_other_upload(struct peers *s, const struct session *sender, double begun)
{
	struct session *stalled = NULL, *latest = NULL;
	for (struct session *p = LIST_FIRST(&s->sessions); p; p = LIST_NEXT(p, next)) {
		const struct upload *u = p == sender ? NULL : p->upload;
		if (!u)
			continue;
		if (has_stalled(p) && (!stalled || u->pace.progress_at < stalled->upload->pace.progress_at))
			stalled = p;
		if (u->received_bytes && !u->flush && u->pace.begun_at > begun) {
			latest = p;
			begun = u->pace.begun_at;
		}
	}
	struct error e;
	if (stalled) {
		error_set(&e, EBUSY, "its files came too slowly, and others need their room: try again later");
		refuse_upload(stalled, &e);
	} else if (latest) {
		error_set(&e, EBUSY,
			  "a submission that was begun earlier needs the room of its files: try again later");
		refuse_upload(latest, &e);
	}
	return stalled || latest;
}

static void handle_submit(struct session *p, struct envelope *env)
{
	struct error e;
	if (p->upload) {
		session_fault(p, "one submission at a time");
		return;
	}
	size_t bytes = env->bytes;
	while (bytes > SUBMIT_BYTES_MAX - p->peers->submit_message_bytes && evict_other_upload(p->peers, p, INFINITY))
		continue;
	if (bytes > SUBMIT_BYTES_MAX - p->peers->submit_message_bytes) {
		answer_submit(p, 0, "too many submissions are being sent to the coordinator: try again later", NULL);
		return;
	}
	if (upload_new(&p->upload, env, p->jobs->blobs, p->jobs->config.worker_bandwidth, &e)) {
		p->upload = NULL;
		answer_submit(p, 0, e.text, NULL);
		return;
	}
	p->upload->pace.begun_at = jobs_now(p->jobs);
	p->upload->pace.progress_at = INFINITY;
	p->submit_message_bytes = bytes;
	p->peers->submit_message_bytes += bytes;
	if (check_capacity(p, &e)) {
		refuse_upload(p, &e);
		return;
	}
	p->waiting_heartbeat_at = jobs_now(p->jobs);
	look_up_files(p);
}

void client_file_checked(struct session *p, const struct blob_hash *h, bool is_intact)
{
	if (p->state == SESSION_CLIENT && p->upload && upload_file_checked(p->upload, h, is_intact))
		look_up_files(p);
}

static void on_flushed(void *user, int rc, const struct error *why)
{
	struct session *p = user;
	struct error e = *why;
	if (p->state != SESSION_CLIENT || p->jobs->is_stopping)
		return;
	if (!rc && p->upload->missing_count == 0)
		submit_job(p);
	else if (rc || upload_flush(p->upload, p->jobs->loop, on_flushed, p, &e))
		refuse_upload(p, &e);
}

static void note_progress(const struct session *p)
{
	struct upload *u = p->upload;
	if (u->received_bytes - u->pace.progress_bytes < PACE_BYTES)
		return;
	u->pace.progress_bytes = u->received_bytes;
	u->pace.progress_at = jobs_now(p->jobs);
}

static void handle_blob_chunk(struct session *p, const Farm__BlobChunk *c, const unsigned char *payload, size_t size)
{
	struct error e;
	if (!p->upload || upload_is_looking_up(p->upload)) {
		session_fault(p, "a blob without a submission");
		return;
	}
	int rc;
	do
		rc = upload_add_chunk(p->upload, c, payload, size, &e);
	while (rc == -EFBIG &&
	       evict_other_upload(p->peers, p, p->upload->writer ? p->upload->pace.begun_at : INFINITY));
	if (rc >= 0)
		note_progress(p);
	if (rc > 0) {
		log_event(LOG_BLOB_STORED, "peer=%llu bytes=%llu", (unsigned long long)p->id,
			  (unsigned long long)c->size);
		rc = upload_flush(p->upload, p->jobs->loop, on_flushed, p, &e);
	}
	if (rc < 0)
		refuse_upload(p, &e);
}

static void handle_job_list(struct session *p)
{
	struct job_view *views;
	size_t count = jobs_list_views(p->jobs, ENDED_JOBS_MAX, &views);
	Farm__JobStatus *status = mem_alloc(count, sizeof *status), **list = mem_alloc(count, sizeof *list);
	Farm__JobListAnswer answer = MESSAGE(job_list_answer, .jobs = list);
	for (size_t i = 0; status && list && i < count; i++) {
		if (!client_may_see(p, &views[i]))
			continue;
		view_to_wire(&views[i], &status[i]);
		list[answer.n_jobs++] = &status[i];
	}
	conn_send(p->conn, ENVELOPE_OF(JOB_LIST_ANSWER, job_list_answer, &answer), NULL, 0);
	mem_free(status);
	mem_free(list);
	mem_free(views);
}

static void handle_watch(struct session *p, uint64_t job)
{
	struct job_view v;
	if (!client_find_job(p, job, &v)) {
		session_fault(p, "j%llu: no such job", (unsigned long long)job);
		return;
	}
	p->watched_job = job;
	mem_free(p->last_sent_status);
	p->last_sent_status = NULL;
	client_tick(p);
}

void client_tick(struct session *p)
{
	struct job_view v;
	struct view_looks looks;
	Farm__JobStatus status;
	if (!p->watched_job || p->state != SESSION_CLIENT || conn_unsent_bytes(p->conn))
		return;
	if (!client_find_job(p, p->watched_job, &v)) {
		session_fault(p, "the job is no longer known");
		return;
	}
	if (p->last_sent_status && memcmp(p->last_sent_status, &v, sizeof v) == 0)
		return;
	if (!p->last_sent_status && !(p->last_sent_status = mem_alloc(1, sizeof v)))
		return;
	*p->last_sent_status = v;
	view_to_wire(&v, &status);
	view_looks_to_wire(&v, &looks, &status);
	conn_send(p->conn, ENVELOPE_OF(JOB_STATUS, job_status, &status), NULL, 0);
	if (record_is_ended(&v.record)) {
		p->ended_watch.job = p->watched_job;
		p->ended_watch.notified_at = jobs_now(p->jobs);
		p->watched_job = 0;
	}
}

void client_handle_message(struct session *p, struct envelope *env, const unsigned char *payload, size_t size)
{
	const Farm__Envelope *m = env->message;
	switch (m->body_case) {
	case FARM__ENVELOPE__BODY_HEARTBEAT:
		break;
	case FARM__ENVELOPE__BODY_SUBMIT:
		handle_submit(p, env);
		break;
	case FARM__ENVELOPE__BODY_BLOB_CHUNK:
		handle_blob_chunk(p, m->blob_chunk, payload, size);
		break;
	case FARM__ENVELOPE__BODY_JOB_LIST:
		handle_job_list(p);
		break;
	case FARM__ENVELOPE__BODY_WORKER_LIST:
		worker_list_send(p);
		break;
	case FARM__ENVELOPE__BODY_CANCEL:
		control_cancel(p, m->cancel->job);
		break;
	case FARM__ENVELOPE__BODY_CONTROL:
		control_apply(p, m->control);
		break;
	case FARM__ENVELOPE__BODY_WATCH:
		handle_watch(p, m->watch->job);
		break;
	case FARM__ENVELOPE__BODY_FETCH:
		fetch_begin(p, m->fetch);
		break;
	case FARM__ENVELOPE__BODY_BYE:
		conn_close(p->conn, "the client ended the connection");
		break;
	default:
		session_fault(p, "not a message for a client to send");
	}
}
