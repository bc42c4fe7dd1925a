/* SPDX-License-Identifier: Apache-2.0 */
/*
 * One running job: its films, seeds, chain states and log.
 *
 * live_job_new takes over the submission and starts the record. Bootstrap results are collected until
 * live_job_prepare makes b, seeds and canvas from them. Then live_job_merge adds each result to the films and keeps
 * its chain states for the next lease of its group and part. Results that arrive while a thread reads the films wait
 * in a list.
 *
 * live_job_merge may fail half way: with -ENOMEM, after which the films must not be used, or with -ERANGE if a sum
 * leaves the grid. Errors of the log are ignored: no job fails because of them.
 */
#include "coordinator/live_job/live_job.h"

#include "common/base/clock.h"
#include "common/base/disk.h"
#include "common/base/mem.h"
#include "common/base/text.h"

#include <assert.h>
#include <fcntl.h>
#include <math.h>
#include <stdarg.h>
#include <string.h>

static const uint64_t max_log_bytes = 16 << 20;

const Farm__Submit *live_job_submission(const struct live_job *job)
{
	return job->submission.message->submit;
}

static json_t *effects_to_json(const Farm__Submit *m)
{
	json_t *list = json_array();
	for (size_t i = 0; i < m->n_effects; i++)
		json_array_append_new(list, json_pack("{s:s s:b s:b s:s s:s}", "name", m->effects[i]->name, "on",
						      (int)m->effects[i]->on, "forced", (int)m->effects[i]->forced,
						      "why", m->effects[i]->why, "saves", m->effects[i]->saves));
	return list;
}

static void begin_record(struct live_job *job, const char *owner, double submitted)
{
	const Farm__Submit *m = live_job_submission(job);
	struct job_record *r = &job->record;
	record_init(r, job->id, m->name, owner);
	text_copy(r->integrator, sizeof r->integrator, job->plan.integrator);
	text_copy(r->mixture, sizeof r->mixture, job->plan.mutations);
	text_copy(r->state, sizeof r->state, "queued");
	text_copy(r->output, sizeof r->output, m->output);
	r->priority = m->priority;
	record_set_effects(r, effects_to_json(m));
	text_join_lines(r->scene_notes, sizeof r->scene_notes, (const char *const *)m->notes, m->n_notes);
	r->target_error = job->plan.target_error;
	r->submitted = submitted > 0 ? submitted : clock_wall_seconds();
}

int live_job_new(struct live_job **out, uint64_t id, struct envelope *submit, const struct plan *plan,
		 const char *owner, double submitted, struct spool *s, struct error *e)
{
	struct live_job *job = mem_alloc(1, sizeof *job);
	if (!job)
		return error_set(e, ENOMEM, "no memory for a job");
	job->id = id;
	job->log_fd = -1;
	job->plan = *plan;
	job->submission = *submit;
	memset(submit, 0, sizeof *submit);
	STAILQ_INIT(&job->waiting_messages);
	job->times = (struct live_job_times){NAN, NAN, NAN};
	begin_record(job, owner, submitted);
	job->states = mem_alloc((size_t)plan->groups * plan->parts, sizeof *job->states);
	job->makers = mem_alloc((size_t)plan->groups * plan->parts, sizeof *job->makers);
	job->is_replacement = mem_alloc((size_t)plan->groups * plan->parts, sizeof *job->is_replacement);
	if (plan->kind == PLAN_CHAINS) {
		job->chains_per_lease = plan->chains / (plan->groups * plan->parts);
		job->seeds = mem_alloc(plan->chains, sizeof *job->seeds);
	}
	int rc = 0;
	if (!job->states || !job->makers || !job->is_replacement || (plan->kind == PLAN_CHAINS && !job->seeds))
		rc = error_set(e, ENOMEM, "no memory for a job");
	if (!rc)
		rc = bootstrap_new(&job->bootstrap, plan, e);
	char path[SPOOL_PATH_MAX];
	spool_job_path(s, id, "log", path);
	job->log_fd = rc ? -1 : disk_open(path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
	if (!rc && job->log_fd < 0)
		rc = error_file(e, errno, path);
	struct stat st;
	if (!rc && disk_fstat(job->log_fd, &st) == 0)
		job->log_bytes = (uint64_t)st.st_size;
	if (rc) {
		*submit = job->submission;
		memset(&job->submission, 0, sizeof job->submission);
		live_job_free(job);
		return rc;
	}
	*out = job;
	return 0;
}

void live_job_free(struct live_job *job)
{
	assert(!job->is_busy);
	for (struct waiting_message *w; (w = live_job_pop_waiting(job));)
		waiting_message_free(w);
	for (uint32_t i = 0; job->states && i < job->plan.groups * job->plan.parts; i++)
		chain_states_free(job->states[i], job->chains_per_lease);
	mem_free(job->states);
	mem_free(job->makers);
	mem_free(job->is_replacement);
	mem_free(job->merged_records);
	mem_free(job->seeds);
	mem_free(job->unverified_counts);
	mem_free(job->late_results);
	bootstrap_free(job->bootstrap);
	canvas_free(job->canvas);
	if (job->log_fd >= 0)
		disk_close(job->log_fd);
	journal_release(job->journal);
	envelope_fini(&job->submission);
	mem_free(job->earlier_record);
	mem_free(job);
}

void live_job_log(struct live_job *job, enum log_event event, const char *fields, ...)
{
	enum { TEXT = 1800 };
	char text[TEXT], line[TEXT + 200];
	va_list ap;
	va_start(ap, fields);
	vsnprintf(text, sizeof text, fields, ap);
	va_end(ap);
	text_clean(text);
	if (!log_event(event, "job=j%llu %s", (unsigned long long)job->id, text))
		return;
	log_format(line, sizeof line - 1, event, text);
	size_t size = strlen(line);
	line[size++] = '\n';
	if (job->log_bytes >= max_log_bytes)
		return;
	job->log_bytes += size;
	if (job->log_bytes >= max_log_bytes)
		size = (size_t)snprintf(line, sizeof line,
					"the log of this job is full: the rest is in the coordinator's log\n");
	int rc = disk_write_all(job->log_fd, line, size); /* if this fails, the coordinator's log still has the line */
	(void)rc;
}

static struct chain_state **states_at(const struct live_job *job, const struct lease_key *k)
{
	return &job->states[(size_t)k->group * job->plan.parts + k->part];
}

void live_job_set_states(struct live_job *job, uint32_t slot, struct chain_state *states)
{
	job->state_bytes += chain_states_bytes(states, job->chains_per_lease);
	job->state_bytes -= chain_states_bytes(job->states[slot], job->chains_per_lease);
	chain_states_free(job->states[slot], job->chains_per_lease);
	job->states[slot] = states;
}

int live_job_merge(struct live_job *job, struct batch *b, struct error *e)
{
	job->record.cpu_seconds += b->cpu_seconds;
	if (b->key.kind == LEASE_BOOTSTRAP)
		job->record.bootstrap_cpu_seconds = job->record.cpu_seconds;
	if (b->key.kind == LEASE_BOOTSTRAP)
		return bootstrap_add(job->bootstrap, b, e);
	int rc = canvas_add(job->canvas, b, e);
	if (!rc && job->plan.kind == PLAN_CHAINS) {
		uint32_t slot = b->key.group * job->plan.parts + b->key.part;
		live_job_set_states(job, slot, b->states);
		b->states = NULL;
		b->state_count = 0;
		job->is_replacement[slot] = false;
	}
	return rc;
}

uint64_t live_job_complete_rounds(const struct live_job *job)
{
	return job->canvas ? canvas_complete_rounds(job->canvas) : 0;
}

void live_job_note_times(struct live_job *job, double elapsed, uint64_t rounds)
{
	if (!isfinite(elapsed))
		return;
	job->times.elapsed = elapsed;
	if (!job->canvas)
		job->times.first_round_at = elapsed; /* remains the time of the last bootstrap batch */
	if (live_job_complete_rounds(job) > rounds)
		job->times.last_round_end = elapsed;
}

int live_job_prepare(struct live_job *job, const char *canvas_folder, struct error *e)
{
	bootstrap_compute_b(job->bootstrap, &job->bootstrap_result);
	int exponent =
		canvas_grid_exponent(&job->plan, job->bootstrap_result.b_pooled, live_job_submission(job)->brightest);
	int rc = canvas_new(&job->canvas, &job->plan, exponent, canvas_folder, e);
	if (rc)
		return rc;
	bootstrap_add_to_canvas(job->bootstrap, job->canvas);
	uint32_t per_group = job->plan.kind == PLAN_CHAINS ? job->plan.chains / job->plan.groups : 0;
	for (uint32_t g = 0; job->seeds && g < job->plan.groups; g++)
		bootstrap_draw_seeds(job->bootstrap, g, job->seeds + (size_t)g * per_group);
	bootstrap_free(job->bootstrap);
	job->bootstrap = NULL;
	return 0;
}

int live_job_pack_lease(const struct live_job *job, const struct lease_key *k, bool from_seeds, unsigned char **frame,
			size_t *size, struct error *e)
{
	if (k->kind == LEASE_BOOTSTRAP || job->plan.kind != PLAN_CHAINS)
		return grant_pack(k, NULL, NULL, 0, frame, size, e);
	if (k->epoch > 0 && !from_seeds)
		return grant_pack(k, NULL, *states_at(job, k), job->chains_per_lease, frame, size, e);
	struct plan_range r = plan_chain_range(&job->plan, k->part);
	assert(r.end - r.begin == job->chains_per_lease);
	const uint64_t *seeds = job->seeds + (size_t)k->group * (job->plan.chains / job->plan.groups) + r.begin;
	return grant_pack(k, seeds, NULL, job->chains_per_lease, frame, size, e);
}

bool live_job_states_match(const struct live_job *job, const struct lease_key *k, const struct blob_hash *digest)
{
	struct blob_hash current;
	struct error e;
	bool begins_with_states = k->kind == LEASE_RENDER && job->plan.kind == PLAN_CHAINS &&
				  k->group < job->plan.groups && k->part < job->plan.parts && k->epoch > 0 &&
				  *states_at(job, k);
	return begins_with_states &&
	       chain_states_digest(*states_at(job, k), job->chains_per_lease, &current, &e) == 0 &&
	       blob_hash_equal(&current, digest);
}

void live_job_count_worker(struct live_job *job, uint64_t peer)
{
	enum { REMEMBERED = sizeof job->last_workers / sizeof *job->last_workers };
	for (uint32_t i = 0; i < REMEMBERED; i++)
		if (job->last_workers[i] == peer)
			return;
	job->last_workers[job->worker_count++ % REMEMBERED] = peer;
}

static size_t waiting_size(const struct waiting_message *w)
{
	return sizeof *w + w->envelope.bytes + w->payload.capacity;
}

bool live_job_enqueue_message(struct live_job *job, uint64_t peer, const struct lease_key *k, struct envelope *env,
			      struct buf *payload, bool files_checked)
{
	struct waiting_message *w = mem_alloc(1, sizeof *w);
	if (!w)
		return false;
	*w = (struct waiting_message){
		.peer = peer, .key = *k, .envelope = *env, .payload = *payload, .has_files_checked = files_checked};
	memset(env, 0, sizeof *env);
	memset(payload, 0, sizeof *payload);
	STAILQ_INSERT_TAIL(&job->waiting_messages, w, next);
	job->waiting_bytes += waiting_size(w);
	return true;
}

const struct waiting_message *live_job_find_waiting(const struct live_job *job, const struct lease_key *k)
{
	const struct waiting_message *w;
	STAILQ_FOREACH(w, &job->waiting_messages, next) {
		if (lease_key_equal(&w->key, k))
			break;
	}
	return w;
}

static struct waiting_message *remove_waiting(struct live_job *job, struct waiting_message *w)
{
	if (!w)
		return NULL;
	STAILQ_REMOVE(&job->waiting_messages, w, waiting_message, next);
	job->waiting_bytes -= waiting_size(w);
	return w;
}

void live_jobs_drop_waiting(struct live_job *first, uint64_t peer)
{
	for (struct live_job *job = first; job; job = job->next)
		for (struct waiting_message *w = STAILQ_FIRST(&job->waiting_messages), *next; w; w = next) {
			next = STAILQ_NEXT(w, next);
			if (w->peer == peer)
				waiting_message_free(remove_waiting(job, w));
		}
}

struct waiting_message *live_job_pop_waiting(struct live_job *job)
{
	return remove_waiting(job, STAILQ_FIRST(&job->waiting_messages));
}

static bool is_failure(const struct waiting_message *w)
{
	const Farm__Envelope *m = w->envelope.message;
	return m->body_case == FARM__ENVELOPE__BODY_LEASE_FAILED && !m->lease_failed->bad_states;
}

struct waiting_message *live_job_pop_failure(struct live_job *job, uint64_t peer)
{
	struct waiting_message *w = STAILQ_FIRST(&job->waiting_messages);
	while (w && (w->peer != peer || !is_failure(w)))
		w = STAILQ_NEXT(w, next);
	return remove_waiting(job, w);
}

void waiting_message_free(struct waiting_message *w)
{
	envelope_fini(&w->envelope);
	buf_fini(&w->payload);
	mem_free(w);
}

void live_job_release_blobs(const Farm__Submit *m, struct blob_store *s)
{
	for (size_t i = 0; i < m->n_files; i++) {
		struct blob_hash h = file_hash_from_wire(m->files[i]);
		blob_release(s, &h);
	}
}

uint64_t live_job_asset_bytes(const Farm__Submit *m)
{
	uint64_t sum = 0;
	for (size_t i = 0; i < m->n_files; i++)
		if (__builtin_add_overflow(sum, m->files[i]->size, &sum))
			return UINT64_MAX;
	return sum;
}
