/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Do two integrators render the same image? (agreement.h) Groups are rendered by threads; the film of each batch is
 * summed per block. judge_cells tests the differences of the blocks' means by Welch's t between groups, at a level
 * shared by all cells, and prints which bias would have been found.
 */
#include "worker/render/render.h"
#include "tests/support/agreement.h"

#include "common/estimate/merge.h"
#include "common/plan/resample.h"
#include "tests/support/test_length.h"
#include "tests/support/stats.h"

#include <pthread.h>
#include <stdatomic.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* Limit on the comparisons in the whole suite: they share the family-wise level of 1e-4. */
enum { COMPARISONS = 128 };
#define LEVEL (1e-4 / COMPARISONS)

/* One group: its own bootstrap (chains), all its leases of all rounds. */
struct group_run {
	const struct world *w;
	const struct plan *p;
	const struct brightness *map; /* shared by all groups, as in a render */
	uint32_t group;
	double *mean;
	double sum[AGREEMENT_CELLS + 1];
	double independent_sum, independent_count;
	uint64_t counters[BATCH_COUNTERS];
	uint64_t strategy[BATCH_STRATEGIES][STRATEGY_COUNTERS];
	char failure[256];
};

static uint32_t cell_at(const struct plan *p, uint32_t x, uint32_t y)
{
	return (y * AGREEMENT_BLOCKS / p->height) * AGREEMENT_BLOCKS + x * AGREEMENT_BLOCKS / p->width;
}

static void add_batch(struct group_run *g, const struct batch *b)
{
	for (uint32_t t = 0; t < b->tile_count; t++) {
		const struct tile *tile = &b->tiles[t];
		for (uint32_t i = 0; i < tile->width * tile->height; i++) {
			const float *v = tile->xyz + 3 * (size_t)i;
			double s = (double)v[0] + (double)v[1] + (double)v[2];
			g->sum[cell_at(g->p, tile->x + i % tile->width, tile->y + i / tile->width)] += s;
			g->sum[AGREEMENT_CELLS] += s;
		}
	}
	g->independent_sum += b->independent_sum;
	g->independent_count += (double)b->counters[COUNT_INDEPENDENT];
	for (int i = 0; i < BATCH_COUNTERS; i++)
		g->counters[i] += b->counters[i];
	for (uint32_t i = 0; i < b->strategy_count; i++)
		for (int k = 0; k < STRATEGY_COUNTERS; k++)
			g->strategy[i][k] += b->strategies[i][k];
}

static bool run_lease(struct group_run *g, const struct lease_key *k, const struct lease_input *in, struct batch *b)
{
	struct error e = {""};
	enum lease_outcome end;
	if (render_lease(g->w, g->p, k, in, NULL, &end, b, &e) == 0)
		return true;
	snprintf(g->failure, sizeof g->failure, "%.250s", e.text);
	return false;
}

static bool run_bootstrap(struct group_run *g, uint64_t *seeds)
{
	const struct plan *p = g->p;
	float *weights = calloc(p->bootstrap / p->groups, sizeof *weights);
	uint64_t n = 0;
	for (uint32_t part = 0; part < p->parts; part++) {
		struct lease_key k = {1, LEASE_BOOTSTRAP, g->group, part, 0};
		struct batch b;
		if (!run_lease(g, &k, NULL, &b)) {
			free(weights);
			return false;
		}
		memcpy(weights + n, b.weights, b.weight_count * sizeof *weights);
		n += b.weight_count;
		add_batch(g, &b);
		batch_fini(&b);
	}
	memset(g->counters, 0, sizeof g->counters);
	bool lit =
		plan_resample(p, g->group, weights, n, plan_resample_offset(p, g->group), p->chains / p->groups, seeds);
	free(weights);
	if (!lit)
		snprintf(g->failure, sizeof g->failure, "the bootstrap is black");
	return lit;
}

static bool run_part(struct group_run *g, uint32_t part, const uint64_t *seeds)
{
	struct plan_range r = plan_chain_range(g->p, part);
	struct batch previous = {.state_count = 0};
	bool ok = true;
	for (uint64_t epoch = 0; epoch < g->p->rounds && ok; epoch++) {
		struct lease_key k = {1, LEASE_RENDER, g->group, part, epoch};
		struct lease_input in = {.chain_count = (uint32_t)(r.end - r.begin),
					 .seeds = epoch ? NULL : seeds + r.begin,
					 .states = previous.states};
		struct batch b;
		if (g->p->kind == PLAN_SAMPLES)
			in = (struct lease_input){.map = g->map};
		ok = run_lease(g, &k, &in, &b);
		batch_fini(&previous);
		previous = (struct batch){.state_count = 0};
		if (ok) {
			add_batch(g, &b);
			previous = b;
		}
	}
	batch_fini(&previous);
	return ok;
}

static void run_group(struct group_run *g)
{
	const struct plan *p = g->p;
	uint64_t *seeds = calloc((size_t)p->chains / p->groups + 1, sizeof *seeds);
	bool ok = p->kind == PLAN_SAMPLES || run_bootstrap(g, seeds);
	for (uint32_t part = 0; part < p->parts && ok; part++)
		ok = run_part(g, part, seeds);
	free(seeds);
	double pixels = (double)p->width * p->height, samples = (double)(p->epoch * p->rounds), scale = 1 / samples;
	if (p->kind == PLAN_CHAINS)
		scale = g->independent_sum / g->independent_count / (samples * p->chains / p->groups);
	for (int c = 0; c <= AGREEMENT_CELLS; c++)
		g->mean[c] = g->sum[c] * scale / (c < AGREEMENT_CELLS ? pixels / AGREEMENT_CELLS : pixels);
}

struct queue {
	struct group_run *runs;
	uint32_t count;
	atomic_uint next;
};

static void *run_groups(void *arg)
{
	struct queue *q = arg;
	for (uint32_t g; (g = atomic_fetch_add(&q->next, 1)) < q->count;)
		run_group(&q->runs[g]);
	return NULL;
}

static void make_plan(const struct world *w, const char *test, const char *side,
		      const struct agreement_options *options, const char *mutations, uint64_t bootstrap,
		      struct plan *p)
{
	const struct integrator_properties *i = render_integrator_find(options->integrator);
	assert_non_null(i);
	uint64_t spp = options->spp / test_scale();
	char name[128];
	snprintf(name, sizeof name, "%s %s", test, side);
	uint64_t pixels = (uint64_t)w->settings.width * w->settings.height;
	uint32_t groups = options->groups;
	*p = (struct plan){.kind = i->kind,
			   .width = w->settings.width,
			   .height = w->settings.height,
			   .crop_width = w->settings.width,
			   .crop_height = w->settings.height,
			   .border = w->settings.border,
			   .seed = stats_seed(name),
			   .groups = groups,
			   .parts = 1,
			   .rounds = 2,
			   .min_depth = options->min_depth ? options->min_depth : 1,
			   .max_depth = options->max_depth ? options->max_depth : w->settings.max_depth};
	strcpy(p->integrator, options->integrator);
	accuracy_settings_print(&w->accuracy, p->accuracy);
	struct error e = {""};
	struct render_summary summary;
	world_summary(w, &summary);
	if (i->has_mutations && render_canonical_mutations(mutations, &summary, p->mutations, &e))
		fail_msg("%s", e.text);
	p->chains = i->kind == PLAN_CHAINS ? groups * 8 : 0;
	p->bootstrap = groups * (test_is_scaled() ? bootstrap / 8 : bootstrap);
	uint64_t sample_count = i->kind == PLAN_CHAINS ? spp * pixels / p->chains : spp / groups;
	p->epoch = sample_count / 2 ? sample_count / 2 : 1;
	if (plan_check(p, &e))
		fail_msg("%s", e.text);
}

void agreement_render_with_mutations(const struct world *w, const char *test, const char *side,
				     const struct agreement_options *options, uint64_t bootstrap, const char *mutations,
				     struct agreement_image *out)
{
	static struct group_run runs[AGREEMENT_GROUPS_MAX];
	struct plan p;
	make_plan(w, test, side, options, mutations, bootstrap, &p);
	struct brightness *map;
	struct error e = {""};
	if (render_brightness_map_new(w, &p, &map, &e))
		fail_msg("%s", e.text);
	memset(runs, 0, sizeof runs);
	*out = (struct agreement_image){.groups = p.groups};
	for (uint32_t g = 0; g < p.groups; g++)
		runs[g] = (struct group_run){.w = w, .p = &p, .map = map, .group = g, .mean = out->mean[g]};
	struct queue q = {runs, p.groups, 0};
	pthread_t other;
	bool has_second_thread = pthread_create(&other, NULL, run_groups, &q) == 0;
	run_groups(&q);
	if (has_second_thread)
		pthread_join(other, NULL);
	render_brightness_map_free(map);
	for (uint32_t g = 0; g < p.groups; g++) {
		if (runs[g].failure[0])
			fail_msg("%s: %s", options->integrator, runs[g].failure);
		for (int i = 0; i < BATCH_COUNTERS; i++)
			out->counters[i] += runs[g].counters[i];
		for (int i = 0; i < BATCH_STRATEGIES; i++)
			for (int k = 0; k < STRATEGY_COUNTERS; k++)
				out->strategy[i][k] += runs[g].strategy[i][k];
	}
	assert_int_equal(out->counters[COUNT_NAN] + out->counters[COUNT_INFINITE] + out->counters[COUNT_NEGATIVE], 0);
}

void agreement_render(const struct world *w, const char *test, const char *side,
		      const struct agreement_options *options, struct agreement_image *out)
{
	agreement_render_with_mutations(w, test, side, options, AGREEMENT_BOOTSTRAP, NULL, out);
}

struct cell {
	double mean, squared_error, degrees_of_freedom; /* squared_error: squared standard error */
};

static struct cell cell_stats(const struct agreement_image *a, int c)
{
	double n = a->groups, m = 0, s = 0;
	for (uint32_t g = 0; g < a->groups; g++)
		m += a->mean[g][c] / n;
	for (uint32_t g = 0; g < a->groups; g++)
		s += (a->mean[g][c] - m) * (a->mean[g][c] - m) / (n - 1);
	return (struct cell){m, s / n, n - 1};
}

static double critical_t(double level, double degrees)
{
	double lo = 0, hi = 1e4;
	for (int i = 0; i < 80; i++) {
		double mid = 0.5 * (lo + hi);
		if (stats_student_t_p(mid, degrees) > level)
			lo = mid;
		else
			hi = mid;
	}
	return hi;
}

struct cell_difference {
	double difference, error, degrees_of_freedom; /* relative to the second mean */
};

static struct cell_difference compare_cells(const struct cell *a, const struct cell *b)
{
	if (a->mean == b->mean) /* both may be black */
		return (struct cell_difference){0, 0, 30};
	double v = a->squared_error + b->squared_error, reference = fabs(b->mean);
	double da = a->degrees_of_freedom > 0 ? a->squared_error * a->squared_error / a->degrees_of_freedom : 0;
	double db = b->degrees_of_freedom > 0 ? b->squared_error * b->squared_error / b->degrees_of_freedom : 0;
	return (struct cell_difference){(a->mean - b->mean) / reference, sqrt(v) / reference,
					da + db > 0 ? v * v / (da + db) : 30};
}

static double detectable_bias(const struct cell_difference *v)
{
	return (critical_t(LEVEL / (AGREEMENT_CELLS + 1), v->degrees_of_freedom) + 1.645) * v->error;
}

static double p_value(const struct cell_difference *v)
{
	return v->error > 0 ? stats_student_t_p(v->difference / v->error, v->degrees_of_freedom) : v->difference == 0;
}

/* Tests the cells by Holm's method; the power is that of the strictest step. */
static void judge_cells(const char *test, const struct cell_difference *v, bool needs_power)
{
	int cells = AGREEMENT_CELLS + 1;
	double worst_block = 0, mean_power = 0;
	for (int c = 0; c < cells; c++) {
		double detectable = detectable_bias(&v[c]), p = p_value(&v[c]);
		if (c < AGREEMENT_CELLS)
			worst_block = fmax(worst_block, detectable);
		else
			mean_power = detectable;
		/* A planted bias of twice the smallest detectable one must be found. */
		double planted = v[c].difference + copysign(2 * detectable, v[c].difference);
		if (v[c].error > 0 && stats_student_t_p(planted / v[c].error, v[c].degrees_of_freedom) > LEVEL / cells)
			fail_msg("%s: cell %d does not see a planted bias of %.2g %%", test, c, 200 * detectable);
		/* Holm's first step: the smallest p-value is compared with level / cells. */
		if (p < LEVEL / cells)
			fail_msg("%s: cell %d differs by %.3g %% +- %.2g %% (p = %.1e)", test, c, 100 * v[c].difference,
				 100 * v[c].error, p);
	}
	print_message(
		"%s: mean differs by %+.3f %% +- %.3f %%; finds with 95 %%: %.2f %% on a block, %.2f %% on the mean\n",
		test, 100 * v[AGREEMENT_CELLS].difference, 100 * v[AGREEMENT_CELLS].error, 100 * worst_block,
		100 * mean_power);
	if (needs_power && !test_is_scaled() && (worst_block > 0.02 || mean_power > 0.005))
		fail_msg("%s: too weak", test);
}

static void compare_images(const struct agreement_image *a, const struct agreement_image *b, struct cell_difference *v)
{
	for (int c = 0; c <= AGREEMENT_CELLS; c++) {
		struct cell x = cell_stats(a, c), y = cell_stats(b, c);
		v[c] = compare_cells(&x, &y);
	}
}

void agreement_measure(const struct agreement_image *a, const struct agreement_image *b,
		       struct agreement_difference *out)
{
	struct cell_difference v[AGREEMENT_CELLS + 1];
	compare_images(a, b, v);
	const struct cell_difference *mean = &v[AGREEMENT_CELLS];
	*out = (struct agreement_difference){mean->difference, mean->error, detectable_bias(mean), 0, true};
	for (int c = 0; c <= AGREEMENT_CELLS; c++) {
		if (c < AGREEMENT_CELLS)
			out->detectable_block_bias = fmax(out->detectable_block_bias, detectable_bias(&v[c]));
		out->agrees &= p_value(&v[c]) >= LEVEL / (AGREEMENT_CELLS + 1);
	}
}

void agreement_check(const char *test, const struct agreement_image *a, const struct agreement_image *b)
{
	struct cell_difference v[AGREEMENT_CELLS + 1];
	compare_images(a, b, v);
	judge_cells(test, v, true);
}

double agreement_check_any_power(const char *test, const struct agreement_image *a, const struct agreement_image *b)
{
	struct cell_difference v[AGREEMENT_CELLS + 1];
	compare_images(a, b, v);
	judge_cells(test, v, false);
	return v[AGREEMENT_CELLS].difference;
}

void agreement_check_constant(const char *test, const struct agreement_image *a, double expected)
{
	struct cell_difference v[AGREEMENT_CELLS + 1];
	for (int c = 0; c <= AGREEMENT_CELLS; c++) {
		struct cell x = cell_stats(a, c), y = {expected, 0, 0};
		v[c] = compare_cells(&x, &y);
	}
	judge_cells(test, v, true);
}
