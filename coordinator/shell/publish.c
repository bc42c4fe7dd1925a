#include "coordinator/shell/publish.h"

#include "common/base/mem.h"
#include "common/base/text.h"
#include "common/film/exr.h"

#include <assert.h>
#include <math.h>
#include <string.h>

struct publishing {
	uv_work_t work;
	struct server *server;
	struct order *order;
	enum publish_what what;
	uint64_t rounds;
	double wall_seconds;
	struct canvas_image image;
	int rc;
	struct error error;
};

static const char *const files[] = {[PUBLISH_PREVIEW] = "preview.exr", [PUBLISH_RESULT] = "result.exr"};

/* Planes for the EXR from interleaved pixels. */
static int add_planes(struct exr_image *x, const float *rgb, const char *prefix, struct error *e)
{
	size_t pixels = (size_t)x->width * x->height;
	for (int c = 0; c < 3; c++) {
		float *plane = mem_alloc(pixels, sizeof *plane);
		if (!plane)
			return error_set(e, ENOMEM, "no memory for an image");
		for (size_t i = 0; i < pixels; i++)
			plane[i] = rgb[3 * i + (size_t)c];
		snprintf(x->names[x->channel_count], sizeof x->names[0], "%s%c", prefix, "RGB"[c]);
		x->planes[x->channel_count++] = plane;
	}
	return 0;
}

static int write_image(struct publishing *w)
{
	const struct plan *p = &w->order->plan;
	struct exr_image x = {.width = w->image.width,
			      .height = w->image.height,
			      .full_width = p->width,
			      .full_height = p->height,
			      .x = p->crop_x,
			      .y = p->crop_y};
	unsigned char *bytes = NULL;
	size_t size = 0;
	int rc = add_planes(&x, w->image.rgb, "", &w->error);
	if (!rc && w->image.error)
		rc = add_planes(&x, w->image.error, "error.", &w->error);
	if (!rc)
		rc = exr_write(&x, &bytes, &size, &w->error);
	if (!rc)
		rc = spool_write(w->server->spool, w->order->id, files[w->what], bytes, size, &w->error);
	mem_free(bytes);
	exr_image_fini(&x);
	return rc;
}

static void run(uv_work_t *work)
{
	struct publishing *w = work->data;
	w->rc = canvas_image(w->order->canvas, w->what == PUBLISH_PREVIEW, &w->image, &w->error);
	if (!w->rc && w->what != PUBLISH_ERROR_ONLY)
		w->rc = write_image(w);
}

static void tell_error(const struct publishing *w)
{
	struct event ev = {.kind = EVENT_ERROR_KNOWN,
			   .job = w->order->id,
			   .error_known = {.job = w->order->id,
					   .rounds = w->rounds,
					   .rel_error = w->rc ? NAN : sqrt(w->image.rel_mse_upper)}};
	server_step(w->server, &ev);
}

/* The core's job is done; only the record knows that there is nothing to fetch. */
static void cannot_write(struct publishing *w)
{
	struct job_record *r = &w->order->record;
	r->exit_code = 3;
	text_copy(r->why, sizeof r->why, w->error.text);
	order_log(w->order, LOG_JOB_FAILED, "text=%s", log_quote(w->error.text).text);
}

static void done(uv_work_t *work, int status)
{
	struct publishing *w = work->data;
	struct server *s = w->server;
	struct order *o = w->order;
	assert(status == 0);
	(void)status;
	if (w->what == PUBLISH_RESULT && w->rc)
		cannot_write(w);
	else if (w->what == PUBLISH_RESULT)
		o->record.has_result = true;
	if (s->stopping) {
		o->busy = false;
	} else {
		uint64_t id = o->id;
		o->busy = false; /* the core may want the final image at once */
		if (w->what == PUBLISH_ERROR_ONLY)
			tell_error(w);
		o = server_order(s, id);
		if (o && !o->busy)
			server_order_free_again(s, o);
		s->changes++;
	}
	canvas_image_fini(&w->image);
	mem_free(w);
}

void publish_start(struct server *s, struct order *o, enum publish_what what, uint64_t rounds)
{
	assert(o && o->canvas);
	if (o->busy && what == PUBLISH_PREVIEW)
		return;
	assert(!o->busy);
	struct publishing *w = mem_alloc(1, sizeof *w);
	if (!w) {
		server_job_broken(s, o->id, "no memory for its image");
		return;
	}
	w->server = s;
	w->order = o;
	w->what = what;
	w->rounds = rounds;
	w->work.data = w;
	o->busy = true;
	int rc = uv_queue_work(&s->loop, &w->work, run, done);
	assert(rc == 0);
	(void)rc;
}
