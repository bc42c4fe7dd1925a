/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Images and errors of live jobs. publish_start gives the films to the thread pool, which makes the image of their
 * complete rounds, judges its convergence, and writes it into the job's folder; until then the job is busy. Then the
 * core is told. If the disk refuses an image, it is tried again, and its job counts as running until the image is
 * written.
 */
#include "coordinator/jobs/publish.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "common/base/text.h"
#include "common/exr/image_file.h"
#include "coordinator/jobs/durable.h"
#include "coordinator/jobs/storage.h"
#include "coordinator/jobs/step.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { HEADER_EFFECTS_MAX = 64 };

static const char *const file_names[] = {[PUBLISH_PREVIEW] = "preview.exr", [PUBLISH_RESULT] = "result.exr"};

static const char *end_name(enum job_end end)
{
	return end == END_BLACK	  ? merge_end_name(MERGE_ROUNDS, true)
	       : end == END_TIME  ? merge_end_name(MERGE_TIME, false)
	       : end == END_ERROR ? merge_end_name(MERGE_ERROR, false)
				  : merge_end_name(MERGE_ROUNDS, false);
}

static void collect_inputs(const Farm__Submit *m, struct plan_scene *out)
{
	*out = (struct plan_scene){.define_count = 0};
	for (size_t i = 0; i < m->n_defines && i < PLAN_DEFINES_MAX; i++)
		out->defines[out->define_count++] = (struct plan_define){m->defines[i]->name, m->defines[i]->value};
	for (size_t i = 0; i < m->n_paths && i < PLAN_PATHS_MAX; i++)
		out->paths[out->path_count++] = m->paths[i];
}

/* Writes the hash of the scene file. Returns false if the submission has no such file. */
static bool scene_hash(const Farm__Submit *m, char hex[BLOB_HEX_SIZE])
{
	struct blob_hash h;
	for (size_t i = 0; i < m->n_files; i++)
		if (strcmp(m->files[i]->name, m->scene) == 0 && m->files[i]->hash.len == sizeof h.bytes) {
			memcpy(h.bytes, m->files[i]->hash.data, sizeof h.bytes);
			blob_hash_to_hex(&h, hex);
			return true;
		}
	return false;
}

static int write_image(struct publish_task *w)
{
	const struct live_job *job = w->job;
	const Farm__Submit *m = live_job_submission(job);
	const char *slash = strrchr(m->scene, '/');
	struct header_effect effects[HEADER_EFFECTS_MAX];
	struct plan_scene inputs;
	char hex[BLOB_HEX_SIZE];
	collect_inputs(m, &inputs);
	struct header_extra x = {.scene = slash ? slash + 1 : m->scene,
				 .scene_hash = scene_hash(m, hex) ? hex : NULL,
				 .inputs = &inputs,
				 .camera = m->camera,
				 .scene_notes = job->record.scene_notes,
				 .effects = effects,
				 .has_mixed_fingerprints = m->mixed,
				 .wall_seconds = w->wall_seconds,
				 .cpu_seconds = job->record.cpu_seconds,
				 .worker_count = job->worker_count,
				 .end_name = w->kind == PUBLISH_RESULT ? end_name(w->end) : NULL};
	for (; x.effect_count < m->n_effects && x.effect_count < HEADER_EFFECTS_MAX; x.effect_count++) {
		const Farm__Effect *f = m->effects[x.effect_count];
		effects[x.effect_count] = (struct header_effect){f->name, f->on, f->forced, f->why, f->saves};
	}
	unsigned char *bytes = NULL;
	size_t size = 0;
	int rc = image_file_encode(&w->image, &job->plan, &x, &bytes, &size, &w->error);
	if (!rc)
		rc = spool_write_job_file(w->jobs->spool, job->id, file_names[w->kind], bytes, size, &w->error);
	mem_free(bytes);
	return rc;
}

static void run_publish_task(uv_work_t *work)
{
	struct publish_task *w = work->data;
	w->rc = canvas_image_init(w->job->canvas, w->kind == PUBLISH_PREVIEW, &w->image, &w->error);
	if (!w->rc)
		convergence_judge(&w->job->plan, &w->image, &w->convergence);
	if (!w->rc && w->kind != PUBLISH_ERROR_ONLY)
		w->rc = write_image(w);
}

/* tell_error and tell_image make steps of the core, which may request the next image at once or end the job, so w may
 * be reused or freed. */
static void tell_error(const struct publish_task *w)
{
	struct jobs *jobs = w->jobs;
	bool doubtful;
	double upper = stated_error_upper(&w->image, &doubtful);
	struct event ev = {
		.kind = EVENT_ERROR_ESTIMATED,
		.job = w->job->id,
		.error_estimated = {.job = w->job->id,
				    .rounds = w->rounds,
				    .rel_error = w->rc ? NAN : upper,
				    .rel_mse = w->rc ? NAN : w->image.rel_mse,
				    .degrees = w->rc ? NAN : w->image.rel_mse_degrees,
				    .doubtful = !w->rc && doubtful,
				    .cpu_seconds = w->job->record.cpu_seconds - w->job->record.bootstrap_cpu_seconds,
				    .black = !w->rc && w->image.is_black}};
	jobs_step(jobs, &ev);
	durable_store_look(jobs, ev.job);
}

static void tell_image(const struct publish_task *w)
{
	uint64_t job = w->job->id;
	if (*w->convergence.text)
		live_job_log(w->job, LOG_JOB_NOTE, "text=%s", log_quote(w->convergence.text).text);
	struct event ev = {
		.kind = EVENT_IMAGE_PUBLISHED,
		.job = job,
		.image_published = {.job = job, .chains_disagree = w->convergence.verdict == CHAINS_DISAGREE}};
	jobs_step(w->jobs, &ev);
}

/* Keeps a job that the core has ended until the disk accepts the image. */
static void note_write_failure(struct publish_task *w)
{
	struct live_job *job = w->job;
	job->is_publish_pending = true;
	job->pending_publish_rounds = w->rounds;
	if (disk_is_full(w->rc))
		storage_evict(w->jobs);
	job->retry_at = jobs_now(w->jobs) + w->jobs->config.retry_seconds;
	if (strcmp(job->record.why, w->error.text) != 0)
		live_job_log(job, LOG_SPOOL_FAULT, "text=%s action=\"it will be tried again\"",
			     log_quote(w->error.text).text);
	text_copy(job->record.why, sizeof job->record.why, w->error.text);
}

static void note_written(struct live_job *job)
{
	job->record.has_result = true;
	job->record.cleared = 0;
	job->record.why[0] = 0;
}

/* Stores the outcome in the live job. */
static void store_outcome(struct publish_task *w)
{
	struct live_job *job = w->job;
	/* Every image states its error, whether the job has a target error or not. */
	if (!w->rc && isfinite(w->image.rel_mse_upper))
		record_set_error(&job->record, &w->image);
	if (!w->rc)
		record_set_convergence(&job->record, &w->image, &w->convergence);
	if (w->kind == PUBLISH_RESULT && !w->rc)
		job->is_black = w->image.is_black;
	if (w->kind == PUBLISH_RESULT && w->rc)
		note_write_failure(w);
	else if (w->kind == PUBLISH_RESULT)
		note_written(job);
	else if (w->rc)
		live_job_log(job, LOG_SPOOL_FAULT, "text=%s", log_quote(w->error.text).text);
	if (w->kind == PUBLISH_PREVIEW)
		job->preview_made_at = jobs_now(w->jobs);
	canvas_image_fini(&w->image);
}

static void on_publish_done(uv_work_t *work, int status)
{
	struct publish_task *w = work->data;
	struct jobs *jobs = w->jobs;
	uint64_t id = w->job->id;
	assert(status == 0);
	(void)status;
	store_outcome(w);
	w->job->is_busy = false;
	if (jobs->is_stopping)
		return;
	if (w->kind == PUBLISH_ERROR_ONLY)
		tell_error(w);
	else if (w->kind == PUBLISH_RESULT && !w->rc)
		tell_image(w);
	jobs_notify_films_free(jobs);
	jobs->peers.serve_previews(jobs->peers.user, id);
	jobs->change_count++;
}

void publish_start(struct jobs *jobs, struct live_job *job, enum publish_kind kind, uint64_t rounds)
{
	assert(job && job->canvas);
	assert(!job->is_busy);
	struct publish_task *w = &job->publish_task;
	*w = (struct publish_task){.jobs = jobs, .job = job, .kind = kind, .rounds = rounds};
	struct job_status status; /* for the time from the first lease until now */
	if (farm_job_status(jobs->farm, job->id, jobs_now(jobs), &status)) {
		w->end = status.end;
		w->wall_seconds = (isnan(status.ended_at) ? jobs_now(jobs) : status.ended_at) - status.started_at;
	}
	job->is_busy = true;
	jobs_queue_work(jobs, &w->work, w, run_publish_task, on_publish_done);
}
