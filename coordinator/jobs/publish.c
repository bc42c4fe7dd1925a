/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/jobs/publish.h"

#include "common/base/mem.h"
#include "common/base/text.h"
#include "common/exr/image_file.h"
#include "coordinator/jobs/durable.h"
#include "coordinator/jobs/step.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { HEADER_EFFECTS_MAX = 64 };

static const char *const files[] = {[PUBLISH_PREVIEW] = "preview.exr", [PUBLISH_RESULT] = "result.exr"};

static const char *end_name(enum job_end end)
{
	return end == END_BLACK	  ? merge_end_name(MERGE_ROUNDS, true)
	       : end == END_TIME  ? merge_end_name(MERGE_TIME, false)
	       : end == END_ERROR ? merge_end_name(MERGE_ERROR, false)
				  : merge_end_name(MERGE_ROUNDS, false);
}

static int write_image(struct publishing *w)
{
	const struct live_job *o = w->order;
	const Farm__Submit *m = live_job_submit(o);
	const char *slash = strrchr(m->scene, '/');
	struct header_effect effects[HEADER_EFFECTS_MAX];
	struct header_extra x = {.scene = slash ? slash + 1 : m->scene,
				 .camera = m->camera,
				 .effects = effects,
				 .mixed = m->mixed,
				 .wall_seconds = w->wall_seconds,
				 .cpu_seconds = o->cpu_seconds,
				 .workers = o->worker_count,
				 .end = w->what == PUBLISH_RESULT ? end_name(w->end) : NULL};
	for (; x.effect_count < m->n_effects && x.effect_count < HEADER_EFFECTS_MAX; x.effect_count++) {
		const Farm__Effect *f = m->effects[x.effect_count];
		effects[x.effect_count] = (struct header_effect){f->name, f->on, f->forced, f->why, f->saves};
	}
	unsigned char *bytes = NULL;
	size_t size = 0;
	int rc = image_file_encode(&w->image, &o->plan, &x, &bytes, &size, &w->error);
	if (!rc)
		rc = spool_write(w->jobs->spool, o->id, files[w->what], bytes, size, &w->error);
	mem_free(bytes);
	return rc;
}

static void run(uv_work_t *work)
{
	struct publishing *w = work->data;
	w->rc = canvas_image(w->order->canvas, w->what == PUBLISH_PREVIEW, &w->image, &w->error);
	if (!w->rc)
		convergence_judge(&w->order->plan, &w->image, &w->agreement);
	if (!w->rc && w->what != PUBLISH_ERROR_ONLY)
		w->rc = write_image(w);
}

/* The two that tell the core: it may want the next image at once, or end the job, and w is not ours any more. */
static void tell_error(const struct publishing *w)
{
	struct jobs *s = w->jobs;
	struct event ev = {
		.kind = EVENT_ERROR_KNOWN,
		.job = w->order->id,
		.error_known = {.job = w->order->id,
				.rounds = w->rounds,
				.rel_error = w->rc ? NAN : sqrt(w->image.rel_mse_upper),
				.rel_mse = w->rc ? NAN : w->image.rel_mse,
				.degrees = w->rc ? NAN : w->image.rel_mse_degrees,
				.doubtful = !w->rc && w->image.rel_mse_doubt != ERROR_KNOWN,
				.cpu_seconds = w->order->cpu_seconds - w->order->record.bootstrap_cpu_seconds}};
	jobs_step(s, &ev);
	durable_look(s, ev.job);
}

static void tell_image(const struct publishing *w)
{
	uint64_t job = w->order->id;
	if (*w->agreement.text)
		live_job_log(w->order, LOG_JOB_NOTE, "text=%s", log_quote(w->agreement.text).text);
	struct event ev = {.kind = EVENT_IMAGE_KNOWN,
			   .job = job,
			   .image_known = {.job = job, .disagrees = w->agreement.verdict == CHAINS_DISAGREE}};
	jobs_step(w->jobs, &ev);
}

/* The core's job is done; all that it is made of stays until the disk takes the image. */
static void cannot_write(struct publishing *w)
{
	struct live_job *o = w->order;
	o->unpublished = true;
	o->unpublished_rounds = w->rounds;
	o->try_again = jobs_now(w->jobs) + w->jobs->config.retry_seconds;
	if (strcmp(o->record.why, w->error.text) != 0)
		live_job_log(o, LOG_SPOOL_FAULT, "text=%s action=\"it is tried again\"", log_quote(w->error.text).text);
	text_copy(o->record.why, sizeof o->record.why, w->error.text);
}

static void has_written(struct live_job *o)
{
	o->record.has_result = true;
	o->record.cleared = 0;
	o->record.why[0] = 0;
}

/* What came of it, for the live job. */
static void take(struct publishing *w)
{
	struct live_job *o = w->order;
	/* Every image says how good it is, asked for or not. */
	if (!w->rc && isfinite(w->image.rel_mse_upper))
		record_take_error(&o->record, &w->image);
	if (!w->rc)
		record_take_convergence(&o->record, &w->image, &w->agreement);
	if (w->what == PUBLISH_RESULT && !w->rc)
		o->black = w->image.black;
	if (w->what == PUBLISH_RESULT && w->rc)
		cannot_write(w);
	else if (w->what == PUBLISH_RESULT)
		has_written(o);
	else if (w->rc)
		live_job_log(o, LOG_SPOOL_FAULT, "text=%s", log_quote(w->error.text).text);
	if (w->what == PUBLISH_PREVIEW)
		o->preview_made = jobs_now(w->jobs);
	canvas_image_fini(&w->image);
}

static void done(uv_work_t *work, int status)
{
	struct publishing *w = work->data;
	struct jobs *s = w->jobs;
	uint64_t id = w->order->id;
	assert(status == 0);
	(void)status;
	take(w);
	w->order->busy = false;
	if (s->stopping)
		return;
	if (w->what == PUBLISH_ERROR_ONLY)
		tell_error(w);
	else if (w->what == PUBLISH_RESULT && !w->rc)
		tell_image(w);
	jobs_films_free(s);
	s->peers.films_free(s->peers.user, id);
	s->changes++;
}

void publish_start(struct jobs *s, struct live_job *o, enum publish_what what, uint64_t rounds)
{
	assert(o && o->canvas);
	assert(!o->busy);
	struct publishing *w = &o->publishing;
	*w = (struct publishing){.work.data = w, .jobs = s, .order = o, .what = what, .rounds = rounds};
	struct job_status status; /* from the first lease to now */
	if (farm_job(s->farm, o->id, jobs_now(s), &status)) {
		w->end = status.end;
		w->wall_seconds = (isnan(status.ended) ? jobs_now(s) : status.ended) - status.started;
	}
	o->busy = true;
	int rc = uv_queue_work(s->loop, &w->work, run, done);
	assert(rc == 0);
	(void)rc;
}
