/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/render.h"
#include "tests/support/chains.h"
#include "tests/support/leases.h"

#include "common/plan/resample.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void count(const struct batch *b, struct chains_result *out)
{
	for (int i = 0; i < BATCH_COUNTERS; i++)
		out->counters[i] += b->counters[i];
	for (uint32_t i = 0; i < b->strategy_count; i++)
		for (int k = 0; k < STRATEGY_COUNTERS; k++)
			out->strategy[k] += b->strategy[i][k];
}

static void take_film(const struct batch *b, const struct plan *p, struct chains_result *out)
{
	uint32_t width = p->width, height = p->height;
	for (uint32_t t = 0; t < b->tile_count; t++) {
		const struct tile *tile = &b->tiles[t];
		for (uint32_t i = 0; i < 3 * tile->width * tile->height; i++) {
			uint32_t x = tile->x + i / 3 % tile->width, y = tile->y + i / 3 / tile->width;
			double v = (double)tile->xyz[i];
			out->film_invalid += !isfinite(v) || v < 0;
			out->xyz[3 * ((size_t)y * width + x) + i % 3] = tile->xyz[i];
			out->mean += v;
			out->quarter[2 * (y * 2 / height) + x * 2 / width] += v;
		}
	}
}

static bool bootstrap(const struct world *w, const struct plan *p, uint64_t *seeds, struct chains_result *out)
{
	struct batch b = lease_done(w, p, (struct lease_key){1, LEASE_BOOTSTRAP, 0, 0, 0}, NULL);
	double sum = 0, most = 0;
	for (uint64_t i = 0; i < b.weight_count; i++) {
		sum += (double)b.weights[i];
		if ((double)b.weights[i] > most) {
			most = (double)b.weights[i];
			out->heaviest = i;
		}
	}
	out->heaviest_share = sum > 0 ? most / sum : 0;
	bool lit = plan_resample(p, 0, b.weights, b.weight_count, plan_resample_u(p, 0), p->chains, seeds);
	count(&b, out);
	batch_fini(&b);
	return lit;
}

void chains_run(const struct world *w, const struct chains_how *how, struct chains_result *out)
{
	struct render_summary summary;
	struct error e = {""};
	struct plan p = {.kind = PLAN_CHAINS,
			 .integrator = "hslt",
			 .width = w->settings.width,
			 .height = w->settings.height,
			 .crop_width = w->settings.width,
			 .crop_height = w->settings.height,
			 .border = w->settings.border,
			 .seed = how->seed,
			 .groups = 1,
			 .parts = 1,
			 .chains = how->chains,
			 .bootstrap = how->bootstrap,
			 .epoch = how->steps,
			 .rounds = 1,
			 .min_depth = how->min_depth,
			 .max_depth = how->max_depth};
	uint64_t *seeds = calloc(how->chains, sizeof *seeds);
	*out = (struct chains_result){.xyz = calloc((size_t)p.width * p.height, 3 * sizeof *out->xyz)};
	world_summary(w, &summary);
	if (render_mutations(how->mutations, &summary, p.mutations, &e) || plan_check(&p, &e))
		fail_msg("%s", e.text);
	out->black = !bootstrap(w, &p, seeds, out);
	for (uint32_t i = 0; i < how->chains; i++)
		seeds[i] = out->black ? UINT64_MAX : how->seeds ? how->seeds[i] : seeds[i];
	/* Events counted by the bootstrap alone do not belong to the chains. */
	uint64_t unsound = out->counters[COUNT_NAN] + out->counters[COUNT_INFINITE] + out->counters[COUNT_NEGATIVE];
	assert_int_equal(unsound, 0);
	memset(out->counters, 0, sizeof out->counters);
	struct lease_input in = {.chain_count = how->chains, .seeds = seeds};
	struct batch b = lease_done(w, &p, (struct lease_key){1, LEASE_RENDER, 0, 0, 0}, &in);
	count(&b, out);
	take_film(&b, &p, out);
	uint64_t samples = out->counters[COUNT_SAMPLES], fresh = out->counters[COUNT_INDEPENDENT];
	out->b = fresh > 0 ? b.independent_sum / (double)fresh : 0;
	double scale = 1 / (double)samples;
	out->mean *= scale;
	for (int q = 0; q < 4; q++)
		out->quarter[q] *= scale;
	batch_fini(&b);
	free(seeds);
}
