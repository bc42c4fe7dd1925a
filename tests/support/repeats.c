/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/repeats.h"

#include "tests/support/stats.h"
#include "worker/cli/render/local_run.h"
#include "worker/render/render.h"
#include "worker/render/world/effects.h"

#include <pthread.h>
#include <stdatomic.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

struct queue {
	const struct world *w;
	const struct repeats_options *options;
	repeats_observer *observer;
	void *user;
	struct repeats *out;
	uint64_t seed;
	double *cpu_seconds;
	atomic_uint next, failed;
};

static int make_plan(const struct queue *q, uint32_t i, struct plan *p, struct error *e)
{
	const struct repeats_options *options = q->options;
	struct render_summary s;
	world_summary(q->w, &s);
	const struct integrator_properties *integrator = render_integrator_find(options->integrator);
	struct plan_request r = {.kind = integrator->kind,
				 .width = s.settings.width,
				 .height = s.settings.height,
				 .border = s.settings.border,
				 .seed = q->seed + i,
				 .spp = options->spp,
				 .bootstrap = options->bootstrap,
				 .epoch = options->epoch,
				 .chains = options->chains,
				 .groups = options->groups,
				 .target_error = options->target_error,
				 .min_depth = 1,
				 .max_depth = s.settings.max_depth < integrator->max_depth ? s.settings.max_depth
											   : integrator->max_depth};
	snprintf(r.integrator, sizeof r.integrator, "%s", options->integrator);
	int rc = integrator->has_mutations ? render_canonical_mutations(NULL, &s, r.mixture, e) : 0;
	return rc ? rc : plan_make(&r, p, e);
}

struct round_observer {
	struct queue *q;
	uint32_t render;
};

static void on_round(void *user, const struct local_round *r)
{
	struct round_observer *l = user;
	if (l->q->observer)
		l->q->observer(l->q->user, l->render, r->rounds, r->canvas);
}

static int render_repeat(struct queue *q, uint32_t i, struct error *e)
{
	struct plan p;
	int rc = make_plan(q, i, &p, e);
	if (rc)
		return rc;
	if (i == 0)
		q->out->plan = p;
	atomic_bool stop = false;
	struct round_observer l = {q, i};
	struct local_run run = {
		.world = q->w, .plan = &p, .threads = 1, .stop = &stop, .on_round = on_round, .user = &l};
	rc = local_run(&run, e);
	if (rc)
		return rc;
	rc = canvas_image_init(run.canvas, false, &q->out->images[i], e);
	canvas_free(run.canvas);
	q->cpu_seconds[i] = run.cpu_seconds;
	return rc;
}

static void *run_queue(void *arg)
{
	struct queue *q = arg;
	for (uint32_t i; (i = atomic_fetch_add(&q->next, 1)) < q->options->count;) {
		struct error e = {""};
		if (render_repeat(q, i, &e)) {
			fprintf(stderr, "%s: %s\n", q->options->test, e.text);
			atomic_fetch_add(&q->failed, 1);
		}
	}
	return NULL;
}

void repeats_run(const struct world *w, const struct repeats_options *options, repeats_observer *observer, void *user,
		 struct repeats *out)
{
	char name[128];
	snprintf(name, sizeof name, "%s %s", options->test, options->integrator);
	*out = (struct repeats){.count = options->count,
				.value_count = w->settings.width * w->settings.height * 3,
				.images = calloc(options->count, sizeof *out->images)};
	struct queue q = {.w = w,
			  .options = options,
			  .observer = observer,
			  .user = user,
			  .out = out,
			  .seed = stats_seed(name) % (UINT64_C(1) << 40),
			  .cpu_seconds = calloc(options->count, sizeof *q.cpu_seconds)};
	assert_true(out->images && q.cpu_seconds);
	pthread_t other;
	bool has_second_thread = pthread_create(&other, NULL, run_queue, &q) == 0;
	run_queue(&q);
	if (has_second_thread)
		pthread_join(other, NULL);
	assert_int_equal(q.failed, 0);
	for (uint32_t i = 0; i < options->count; i++)
		out->cpu_seconds += q.cpu_seconds[i];
	free(q.cpu_seconds);
}

void repeats_fini(struct repeats *r)
{
	for (uint32_t i = 0; i < r->count; i++)
		canvas_image_fini(&r->images[i]);
	free(r->images);
	r->images = NULL;
}
