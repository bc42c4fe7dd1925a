/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/repeats.h"

#include "tests/support/stats.h"
#include "worker/cli/render/local.h"
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
	const struct repeats_how *how;
	repeats_look *look;
	void *user;
	struct repeats *out;
	uint64_t seed;
	double *cpu;
	atomic_uint next, failed;
};

static int make_plan(const struct queue *q, uint32_t i, struct plan *p, struct error *e)
{
	const struct repeats_how *how = q->how;
	struct render_summary s;
	world_summary(q->w, &s);
	const struct render_integrator *integrator = render_integrator_find(how->integrator);
	struct plan_request r = {.kind = integrator->kind,
				 .width = s.settings.width,
				 .height = s.settings.height,
				 .border = s.settings.border,
				 .seed = q->seed + i,
				 .spp = how->spp,
				 .bootstrap = how->bootstrap,
				 .epoch = how->epoch,
				 .chains = how->chains,
				 .groups = how->groups,
				 .target_error = how->target_error,
				 .min_depth = 1,
				 .max_depth = s.settings.max_depth < integrator->max_depth ? s.settings.max_depth
											   : integrator->max_depth};
	snprintf(r.integrator, sizeof r.integrator, "%s", how->integrator);
	int rc = integrator->has_mutations ? render_mutations(NULL, &s, r.mixture, e) : 0;
	return rc ? rc : plan_make(&r, p, e);
}

struct looking {
	struct queue *q;
	uint32_t render;
};

static void each_round(void *user, const struct local_round *r)
{
	struct looking *l = user;
	if (l->q->look)
		l->q->look(l->q->user, l->render, r->rounds, r->canvas);
}

static int render(struct queue *q, uint32_t i, struct error *e)
{
	struct plan p;
	int rc = make_plan(q, i, &p, e);
	if (rc)
		return rc;
	if (i == 0)
		q->out->plan = p;
	atomic_bool stop = false;
	struct looking l = {q, i};
	struct local_run run = {
		.world = q->w, .plan = &p, .threads = 1, .stop = &stop, .round = each_round, .user = &l};
	rc = local_run(&run, e);
	if (rc)
		return rc;
	rc = canvas_image(run.canvas, false, &q->out->images[i], e);
	canvas_free(run.canvas);
	q->cpu[i] = run.cpu_seconds;
	return rc;
}

static void *run_repeats(void *arg)
{
	struct queue *q = arg;
	for (uint32_t i; (i = atomic_fetch_add(&q->next, 1)) < q->how->count;) {
		struct error e = {""};
		if (render(q, i, &e)) {
			fprintf(stderr, "%s: %s\n", q->how->test, e.text);
			atomic_fetch_add(&q->failed, 1);
		}
	}
	return NULL;
}

void repeats_run(const struct world *w, const struct repeats_how *how, repeats_look *look, void *user,
		 struct repeats *out)
{
	char name[128];
	snprintf(name, sizeof name, "%s %s", how->test, how->integrator);
	*out = (struct repeats){.count = how->count,
				.values = w->settings.width * w->settings.height * 3,
				.images = calloc(how->count, sizeof *out->images)};
	struct queue q = {.w = w,
			  .how = how,
			  .look = look,
			  .user = user,
			  .out = out,
			  .seed = stats_seed(name) % (UINT64_C(1) << 40),
			  .cpu = calloc(how->count, sizeof *q.cpu)};
	assert_true(out->images && q.cpu);
	pthread_t other;
	bool two = pthread_create(&other, NULL, run_repeats, &q) == 0;
	run_repeats(&q);
	if (two)
		pthread_join(other, NULL);
	assert_int_equal(q.failed, 0);
	for (uint32_t i = 0; i < how->count; i++)
		out->cpu_seconds += q.cpu[i];
	free(q.cpu);
}

void repeats_free(struct repeats *r)
{
	for (uint32_t i = 0; i < r->count; i++)
		canvas_image_fini(&r->images[i]);
	free(r->images);
	r->images = NULL;
}
