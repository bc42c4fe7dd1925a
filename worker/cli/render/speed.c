/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/render/speed.h"

#include "worker/cli/render/local_run.h"
#include "worker/render/count_rays.h"

enum {
	CHAINS = 16,
	BOOTSTRAP = 4096,
	FIRST_EPOCH = 32, /* of chains; each further epoch is eight times as long */
	EPOCH_MAX = 1 << 20,
	SPEED_FILM_PIXELS = 1 << 13, /* pixels */
};
static const double min_seconds = 0.25; /* a render at least as long is measured accurately enough */

/* Samples are measured on a smaller film of the same view, because a round has at least one sample per pixel. */
static void shrink_film(struct render_options *o, struct plan_request *r)
{
	double scale = sqrt(SPEED_FILM_PIXELS / ((double)r->width * r->height));
	r->crop_x = r->crop_y = r->crop_width = r->crop_height = 0;
	if (scale >= 1)
		return;
	r->width = o->width = (uint32_t)fmax(1, round(scale * r->width));
	r->height = o->height = (uint32_t)fmax(1, round(scale * r->height));
}

static struct plan_request speed_request(const struct render_arguments *a)
{
	struct plan_request r = a->plan;
	r.spp = r.mutations = 0;
	r.seconds = r.target_error = r.bandwidth = 0;
	r.groups = r.parts = 1;
	r.chains = r.kind == PLAN_CHAINS ? CHAINS : 0;
	return r;
}

/* Repeats the render, each time with a longer epoch, until it takes long enough to be measured. */
static int measure_in_world(const struct world *w, struct plan_request *r, double *speed, struct error *e)
{
	static const atomic_bool never;
	int counted = r->rays.bootstrap > 0 ? 0 : render_count_rays(w, r, &r->rays, e);
	if (counted)
		return counted;
	uint64_t room = plan_affordable_bootstrap(r, min_seconds);
	r->bootstrap = room < BOOTSTRAP ? room : BOOTSTRAP;
	for (r->epoch = r->kind == PLAN_CHAINS ? FIRST_EPOCH : 1;; r->epoch *= 8) {
		struct plan p;
		r->mutations = r->kind == PLAN_CHAINS ? CHAINS * r->epoch : r->epoch * r->width * r->height;
		int rc = plan_make(r, &p, e);
		struct local_run l = {.world = w, .plan = &p, .threads = 1, .stop = &never};
		if (!rc)
			rc = local_run(&l, e);
		if (rc)
			return rc;
		double seconds = l.cpu_seconds - l.bootstrap_cpu_seconds;
		canvas_free(l.canvas);
		if (l.bootstrap_result.is_black && r->kind == PLAN_CHAINS)
			return 0;
		if (seconds >= min_seconds || r->epoch >= EPOCH_MAX) {
			*speed = fmin((double)plan_round_mutations(&p) / fmax(seconds, 1e-6), PLAN_SPEED_MAX);
			return 0;
		}
	}
}

int speed_measure(const struct render_arguments *a, const char *folder, const char *name, double *speed,
		  struct error *e)
{
	struct plan_request r = speed_request(a);
	struct render_options o = a->render;
	struct scene scene;
	struct world *w;
	*speed = 0;
	if (r.kind == PLAN_SAMPLES)
		shrink_film(&o, &r);
	struct asset_folders folders = option_folders(a, folder);
	struct asset_source assets = asset_source_for_folders(&folders);
	int rc = render_scene_read(&scene, &assets, name, a->defines, a->define_count, &o, e);
	if (rc)
		return rc;
	rc = world_new(&w, &scene, &assets, &o, e);
	scene_fini(&scene);
	if (rc)
		return rc;
	rc = measure_in_world(w, &r, speed, e);
	world_free(w);
	return rc;
}
