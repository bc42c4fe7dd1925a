/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/render.h"
#include "tests/support/render_picture.h"

#include "common/base/mem.h"
#include "tests/support/stats.h"
#include "worker/render/world/world.h"

#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>

#include <cmocka.h>

struct part_run {
	const struct world *w;
	const struct plan *p;
	uint32_t part;
	struct batch batch;
	struct error e;
	int rc;
};

static void *run_part(void *arg)
{
	struct part_run *r = arg;
	struct lease_key k = {1, LEASE_RENDER, 0, r->part, 0};
	enum lease_outcome end;
	r->rc = render_lease(r->w, r->p, &k, NULL, NULL, &end, &r->batch, &r->e);
	return NULL;
}

static void add_part(struct part_run *r, struct picture *out)
{
	if (r->rc)
		fail_msg("%s", r->e.text);
	const uint64_t *n = r->batch.counters;
	assert_int_equal(n[COUNT_NAN] + n[COUNT_INFINITE] + n[COUNT_NEGATIVE], 0);
	float scale = (float)(1 / (double)r->p->epoch);
	for (uint32_t i = 0; i < r->batch.tile_count; i++) {
		const struct tile *t = &r->batch.tiles[i];
		for (size_t k = 0; k < (size_t)t->width * t->height; k++) {
			size_t at = (t->y + k / t->width) * out->image.width + t->x + k % t->width;
			for (size_t c = 0; c < 3; c++)
				out->image.planes[c][at] += scale * t->xyz[3 * k + c];
		}
	}
	batch_fini(&r->batch);
}

static struct plan make_plan(const struct world *w, const struct render_picture_options *options)
{
	struct render_summary s;
	world_summary(w, &s);
	struct plan p = {.kind = PLAN_SAMPLES,
			 .width = s.settings.width,
			 .height = s.settings.height,
			 .crop_width = s.settings.width,
			 .crop_height = s.settings.height,
			 .border = s.settings.border,
			 .seed = stats_seed(options->test),
			 .groups = 1,
			 .parts = 16,
			 .rounds = 1,
			 .bootstrap = 16,
			 .epoch = options->spp,
			 .min_depth = 1,
			 .max_depth = options->max_depth ? options->max_depth : s.settings.max_depth};
	snprintf(p.integrator, sizeof p.integrator, "%s", options->integrator);
	accuracy_settings_print(&w->accuracy, p.accuracy);
	struct error e = {""};
	if (plan_check(&p, &e))
		fail_msg("%s", e.text);
	return p;
}

static void make_black_picture(struct picture *out, uint32_t width, uint32_t height)
{
	*out = (struct picture){.image = {.width = width,
					  .height = height,
					  .channel_count = 3,
					  .full_width = width,
					  .full_height = height}};
	for (int k = 0; k < 3; k++) {
		snprintf(out->image.channel_names[k], sizeof out->image.channel_names[k], "%c", "RGB"[k]);
		out->rgb[k] = out->image.planes[k] = mem_alloc((size_t)width * height, sizeof(float));
		assert_non_null(out->rgb[k]);
	}
}

void render_picture_xyz(const struct world *w, const struct render_picture_options *options, struct picture *out)
{
	struct plan p = make_plan(w, options);
	make_black_picture(out, p.width, p.height);
	/* Two parts at a time, added in order: where their strips overlap because of the filter, sums do not depend on
	 * which part ends first. */
	for (uint32_t part = 0; part < p.parts; part += 2) {
		struct part_run run[2] = {{.w = w, .p = &p, .part = part}, {.w = w, .p = &p, .part = part + 1}};
		pthread_t other;
		bool has_second_thread = pthread_create(&other, NULL, run_part, &run[1]) == 0;
		run_part(&run[0]);
		if (has_second_thread)
			pthread_join(other, NULL);
		else
			run_part(&run[1]);
		add_part(&run[0], out);
		add_part(&run[1], out);
	}
}
