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

static void add_counters(const struct batch *b, struct chains_result *out)
{
	for (int i = 0; i < BATCH_COUNTERS; i++)
		out->counters[i] += b->counters[i];
	for (uint32_t i = 0; i < b->strategy_count; i++)
		for (int k = 0; k < STRATEGY_COUNTERS; k++)
			out->strategy[k] += b->strategies[i][k];
}

static void add_film(const struct batch *b, const struct plan *p, struct chains_result *out)
{
	uint32_t width = p->width, height = p->height;
	for (uint32_t t = 0; t < b->tile_count; t++) {
		const struct tile *tile = &b->tiles[t];
		for (uint32_t i = 0; i < 3 * tile->width * tile->height; i++) {
			uint32_t x = tile->x + i / 3 % tile->width, y = tile->y + i / 3 / tile->width;
			double v = (double)tile->xyz[i];
			out->invalid_film_values += !isfinite(v) || v < 0;
			out->xyz[3 * ((size_t)y * width + x) + i % 3] = tile->xyz[i];
			out->mean += v;
			out->quarter_means[2 * (y * 2 / height) + x * 2 / width] += v;
		}
	}
}

static bool run_bootstrap(const struct world *w, const struct plan *p, uint64_t *seeds, struct chains_result *out)
{
	struct batch b = leases_run(w, p, (struct lease_key){1, LEASE_BOOTSTRAP, 0, 0, 0}, NULL);
	double sum = 0, max_weight = 0;
	for (uint64_t i = 0; i < b.weight_count; i++) {
		sum += (double)b.weights[i];
		if ((double)b.weights[i] > max_weight) {
			max_weight = (double)b.weights[i];
			out->heaviest_index = i;
		}
	}
	out->heaviest_share = sum > 0 ? max_weight / sum : 0;
	bool lit = plan_resample(p, 0, b.weights, b.weight_count, plan_resample_offset(p, 0), p->chains, seeds);
	add_counters(&b, out);
	batch_fini(&b);
	return lit;
}

void chains_run(const struct world *w, const struct chains_options *options, struct chains_result *out)
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
			 .seed = options->seed,
			 .groups = 1,
			 .parts = 1,
			 .chains = options->chains,
			 .bootstrap = options->bootstrap,
			 .epoch = options->steps,
			 .rounds = 1,
			 .min_depth = options->min_depth,
			 .max_depth = options->max_depth};
	uint64_t *seeds = calloc(options->chains, sizeof *seeds);
	*out = (struct chains_result){.xyz = calloc((size_t)p.width * p.height, 3 * sizeof *out->xyz)};
	world_summary(w, &summary);
	if (render_canonical_mutations(options->mutations, &summary, p.mutations, &e) || plan_check(&p, &e))
		fail_msg("%s", e.text);
	out->is_black = !run_bootstrap(w, &p, seeds, out);
	for (uint32_t i = 0; i < options->chains; i++)
		seeds[i] = out->is_black ? UINT64_MAX : options->seeds ? options->seeds[i] : seeds[i];
	/* Events counted by the bootstrap alone do not belong to the chains. */
	uint64_t invalid_count =
		out->counters[COUNT_NAN] + out->counters[COUNT_INFINITE] + out->counters[COUNT_NEGATIVE];
	assert_int_equal(invalid_count, 0);
	memset(out->counters, 0, sizeof out->counters);
	struct lease_input in = {.chain_count = options->chains, .seeds = seeds};
	struct batch b = leases_run(w, &p, (struct lease_key){1, LEASE_RENDER, 0, 0, 0}, &in);
	add_counters(&b, out);
	add_film(&b, &p, out);
	uint64_t samples = out->counters[COUNT_SAMPLES], independent_count = out->counters[COUNT_INDEPENDENT];
	out->normalization = independent_count > 0 ? b.independent_sum / (double)independent_count : 0;
	double scale = 1 / (double)samples;
	out->mean *= scale;
	for (int q = 0; q < 4; q++)
		out->quarter_means[q] *= scale;
	batch_fini(&b);
	free(seeds);
}
