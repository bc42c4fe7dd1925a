/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Stationarity of a mutation (stationary.h): groups of starts on all processors, each with its own seed; the test
 * functions; the test of their differences.
 *
 * A group takes its starts from bdpt's samples in proportion to f, runs STATIONARY_STEPS mutations from each, and sums
 * each function before and after, where a proposal counts with its acceptance probability and the state before it with
 * the rest. judge_groups then tests the mean difference between groups. The result does not depend on the number of
 * threads.
 */
#include "tests/support/test_length.h"
#include "tests/support/stationary.h"

#include "tests/support/stats.h"
#include "worker/render/chain/path_state.h"
#include "tests/support/path_check.h"
#include "worker/render/halfvec/refract.h"
#include "worker/render/render.h"
#include "worker/render/math/fptrap.h"
#include "worker/render/mutation/mixture.h"
#include "worker/render/path/integrator.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define LEVEL 1e-6
/* CHECK_INTERVAL: one in so many final states is checked. */
enum { CHECK_INTERVAL = 16, INNER_VERTICES = 3, LIGHT_EDGES = 4, EDGES = 6 };

struct group {
	const struct world *w;
	const struct stationary_options *options;
	const struct mixture_entry *entry;
	uint64_t seed, start_seed;
	uint32_t number, starts, bootstrap;
	bool has_starts; /* the starts are known, as indices into the bootstrap */
	uint64_t *start_indices;
	double weight;							  /* mean of the bootstrap */
	double first[STATIONARY_FUNCTIONS], change[STATIONARY_FUNCTIONS]; /* means over the starts, times weight */
	uint64_t proposals, accepted, checked_states;
	uint64_t counters[BATCH_COUNTERS], strategy[STRATEGY_COUNTERS];
	char failure[256];
	struct path_context context;
	struct mutation_ctx mutation;
	struct full_path paths[2];
};

static const char *const inner_names[INNER_VERTICES] = {"first", "middle", "last"};
static const char *const quantity_names[5] = {"x", "y", "z", "slope", "cosine"};

const char *stationary_function_name(int i)
{
	static _Thread_local char text[32];
	static const char *const film[] = {"upper left",  "upper right", "lower left",
					   "lower right", "share of X",	 "share of Z"};
	static const char *const ends[] = {"x of x_0",		"y of x_0", "z of x_0", "aperture x", "aperture y",
					   "wavelength",	"edge 0",   "edge 1",	"edge 2",     "edge 3",
					   "last edge but one", "last edge"};
	if (i < 0)
		return "nothing";
	if (i < 6)
		return film[i];
	if (i >= 6 + 5 * INNER_VERTICES)
		return ends[i - 6 - 5 * INNER_VERTICES];
	snprintf(text, sizeof text, "%s of the %s vertex", quantity_names[(i - 6) % 5], inner_names[(i - 6) / 5]);
	return text;
}

static double to_unit(double a, double radius)
{
	return 0.5 * (1 + a / radius);
}

/* Computes functions of edges from their geometry terms: both ends move, and a join depends on nothing else. */
static void evaluate_edges(const struct path_context *c, const struct full_path *x, double out[EDGES])
{
	unsigned k = x->edges;
	for (unsigned i = 0; i < EDGES; i++) {
		unsigned e = i < LIGHT_EDGES ? i : k - (EDGES - i);
		out[i] = 0;
		if (e >= k || (i >= LIGHT_EDGES && e < LIGHT_EDGES))
			continue;
		const struct full_path_edge *g = &x->edge[e];
		double cosines =
			path_cosine(&x->v[e], g->w) * path_cosine(&x->v[e + 1], g->w) * c->w->radius * c->w->radius;
		out[i] = cosines / (cosines + g->distance2);
	}
}

/* Computes all functions, whose values are between 0 and 1, or nearly so. */
static void evaluate_functions(const struct path_context *c, struct full_path *x, double out[STATIONARY_FUNCTIONS])
{
	const struct film_window *f = &c->window;
	double u = (x->film[0] - f->x) / f->width, v = (x->film[1] - f->y) / f->height, xyz[3], *next = out,
	       r = c->w->radius;
	unsigned k = x->edges, inner[INNER_VERTICES] = {k - 1, (k + 1) / 2, 1};
	full_path_colour(c, x, xyz);
	*next++ = (1 - u) * (1 - v);
	*next++ = u * (1 - v);
	*next++ = (1 - u) * v;
	*next++ = u * v;
	*next++ = xyz[0];
	*next++ = xyz[2];
	for (unsigned i = 0; i < INNER_VERTICES; i++, next += 5) {
		const struct path_vertex *p = &x->v[inner[i]];
		memset(next, 0, 5 * sizeof *next);
		if (inner[i] == 0 || inner[i] >= k || (i > 0 && inner[i] == inner[i - 1]))
			continue;
		vec2 h = halfvec_of(x, inner[i]);
		double h2 = vec2_dot(h, h);
		next[0] = to_unit(p->x.p.x, r);
		next[1] = to_unit(p->x.p.y, r);
		next[2] = to_unit(p->x.p.z, r);
		next[3] = isfinite(h2) ? h2 / (1 + h2) : 1;
		next[4] = fabs(vec3_dot(p->x.ng, x->edge[inner[i] - 1].w));
	}
	double size = x->v[0].kind == VERTEX_INFINITE ? 1 : r;
	*next++ = to_unit(x->v[0].x.p.x, size);
	*next++ = to_unit(x->v[0].x.p.y, size);
	*next++ = to_unit(x->v[0].x.p.z, size);
	camera_point_inverse(&c->w->camera, x->v[k].x.p, next);
	next[2] = x->wavelength_u;
	evaluate_edges(c, x, next + 3);
}

static double bootstrap_weight(struct group *g, uint64_t index)
{
	static _Thread_local struct path_sample sample;
	struct sampler_random s;
	sampler_random_init(&s, g->start_seed, RNG_BOOTSTRAP, index, 0);
	path_evaluate_bootstrap(&g->context, &s.base, &sample);
	return sample.intensity;
}

/* Selects indices in proportion to their weights, by systematic resampling. */
static void resample_starts(struct group *g)
{
	double *sum = calloc(g->bootstrap, sizeof *sum), total = 0, r[4];
	uint64_t first = (uint64_t)g->number * g->bootstrap;
	for (uint32_t i = 0; i < g->bootstrap; i++)
		sum[i] = total += bootstrap_weight(g, first + i);
	rng_uniform4(g->start_seed, RNG_RESAMPLING, g->number, 0, 0, r);
	for (uint32_t i = 0, selected = 0; total > 0 && i < g->starts; i++) {
		while (selected + 1 < g->bootstrap && sum[selected] <= (i + r[0]) / g->starts * total)
			selected++;
		g->start_indices[i] = first + selected;
	}
	free(sum);
	g->weight = total / g->bootstrap;
}

/* Returns the logarithm of the geometry term of the edge at which x_b was joined. */
static double log_geometry(const struct full_path *x, unsigned b)
{
	return b > 0 ? log(path_cosine(&x->v[b - 1], x->edge[b - 1].w) / x->edge[b - 1].distance2) : 0;
}

static double planted_log_factor(enum stationary_fault fault, const struct proposal_move *m, const struct full_path *x,
				 const struct full_path *y)
{
	switch (fault) {
	case STATIONARY_NO_TRANSFER:
		return m->log_transfer[MUTATION_REVERSE] - m->log_transfer[MUTATION_FORWARD];
	case STATIONARY_NO_DENSITY:
		return m->log_density[MUTATION_FORWARD] - m->log_density[MUTATION_REVERSE];
	case STATIONARY_NO_GEOMETRY:
		return log_geometry(x, m->b) - log_geometry(y, m->b);
	case STATIONARY_NO_FAULT:
		break;
	}
	return 0;
}

/* Counts values that must not occur; the state itself must not be black either. */
static void count_invalid(struct group *g, double log_weight, bool is_state)
{
	if (isnan(log_weight))
		g->counters[COUNT_NAN]++;
	else if (log_weight == INFINITY || (is_state && isinf(log_weight)))
		g->counters[COUNT_INFINITE]++;
}

/* Proposes y and returns its acceptance probability. */
static double propose_path(struct group *g, struct full_path *x, struct full_path *y, struct proposal_move *move)
{
	const struct mutation_ops *ops = g->entry->ops;
	enum proposal_result end = ops->propose(ops, &g->mutation, &g->entry->forced, x, y, move);
	double to_y = end ? -INFINITY : ops->log_weight(&g->mutation, y, move, MUTATION_FORWARD);
	if (!end && !(to_y > -INFINITY))
		end = PROPOSAL_BLACK;
	count_invalid(g, to_y, false);
	if (end) {
		g->strategy[proposal_counter(end)]++;
		return 0;
	}
	double to_x = ops->log_weight(&g->mutation, x, move, MUTATION_REVERSE);
	count_invalid(g, to_x, true);
	return exp(fmin(to_y - to_x + planted_log_factor(g->options->fault, move, x, y), 0));
}

static void run_start(struct group *g, uint64_t chain, uint64_t index)
{
	struct full_path *x = &g->paths[0], *y = &g->paths[1];
	double now[STATIONARY_FUNCTIONS], next[STATIONARY_FUNCTIONS], first[STATIONARY_FUNCTIONS], r[4];
	if (!path_choose_seed(&g->context, g->start_seed, index, x)) {
		snprintf(g->failure, sizeof g->failure, "start %llu is black", (unsigned long long)index);
		return;
	}
	if (x->edges == 0)
		return;
	full_path_copy(y, x, 0, x->edges);
	evaluate_functions(&g->context, x, first);
	memcpy(now, first, sizeof now);
	g->mutation.chain = chain;
	for (unsigned n = 1; n <= STATIONARY_STEPS; n++) {
		struct proposal_move move = {0};
		g->mutation.step = n;
		g->proposals++;
		double a = propose_path(g, x, y, &move);
		if (a > 0)
			evaluate_functions(&g->context, y, next);
		for (int f = 0; f < STATIONARY_FUNCTIONS; f++)
			g->change[f] += (a > 0 ? a * next[f] + (1 - a) * now[f] : now[f]) - first[f];
		mutation_draw_uniforms(&g->mutation, BLOCK_STRATEGY, r);
		if (r[1] < a) {
			struct full_path *swap = x;
			x = y;
			y = swap;
			memcpy(now, next, sizeof now);
			g->accepted++;
		}
		if (y->edges != x->edges || g->entry->ops->is_independent)
			full_path_copy(y, x, 0, x->edges);
		else
			full_path_copy(y, x, move.first, move.last);
	}
	for (int f = 0; f < STATIONARY_FUNCTIONS; f++)
		g->first[f] += first[f];
	if (chain % CHECK_INTERVAL == 0) {
		g->checked_states++;
		path_check(&g->context, x, g->failure, sizeof g->failure);
	}
}

static void run_group(struct group *g)
{
	const struct scene_settings *s = &g->w->settings;
	g->context = (struct path_context){.w = g->w,
					   .window = {0, 0, s->width, s->height},
					   .min_depth = g->options->min_edges,
					   .max_depth = g->options->max_edges,
					   .counters = g->counters,
					   .refract = halfvec_refract};
	g->mutation = (struct mutation_ctx){.path = &g->context,
					    .seed = g->seed,
					    .counters = g->strategy,
					    .limits = walk_limits_of(&g->w->accuracy)};
	bool watched = fptrap_watch();
	if (!g->has_starts)
		resample_starts(g);
	for (uint32_t i = 0; g->weight > 0 && i < g->starts && !g->failure[0]; i++)
		run_start(g, (uint64_t)g->number * g->starts + i, g->start_indices[i]);
	fptrap_unwatch(watched);
	for (int f = 0; f < STATIONARY_FUNCTIONS; f++) {
		g->first[f] *= g->weight / g->starts;
		g->change[f] *= g->weight / g->starts / STATIONARY_STEPS;
	}
}

struct queue {
	struct group *groups;
	atomic_uint next;
};

static void *run_queued_groups(void *arg)
{
	struct queue *q = arg;
	for (unsigned g; (g = atomic_fetch_add(&q->next, 1)) < STATIONARY_GROUPS;)
		run_group(&q->groups[g]);
	return NULL;
}

static double cpu_seconds(void)
{
	struct timespec t;
	clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
	return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static double critical_t(double level)
{
	double lo = 0, hi = 100;
	for (int i = 0; i < 60; i++) {
		double mid = 0.5 * (lo + hi);
		*(stats_student_t_p(mid, STATIONARY_GROUPS - 1) > level ? &lo : &hi) = mid;
	}
	return hi;
}

static void judge_groups(const struct group *groups, struct stationary_result *out)
{
	double weight = 0, t = critical_t(LEVEL / STATIONARY_FUNCTIONS) + 1.645;
	for (int g = 0; g < STATIONARY_GROUPS; g++)
		weight += groups[g].weight / STATIONARY_GROUPS;
	out->p = 1;
	for (int f = 0; f < STATIONARY_FUNCTIONS; f++) {
		double change[STATIONARY_GROUPS], scale = 0;
		for (int g = 0; g < STATIONARY_GROUPS; g++) {
			change[g] = groups[g].change[f];
			scale += groups[g].first[f] / STATIONARY_GROUPS;
		}
		struct stats_mean m = stats_mean_test(change, STATIONARY_GROUPS, 0);
		/* A function that never changes is 0 up to rounding. */
		if (!(scale > 0) || !(m.error > 1e-12 * weight))
			continue;
		out->bias[f] = m.mean / scale;
		out->error[f] = m.error / scale;
		double detectable = t * out->error[f], p = m.p * STATIONARY_FUNCTIONS;
		double *kind = f < STATIONARY_BLOCKS			    ? &out->detectable_block_bias
			       : f < STATIONARY_BLOCKS + STATIONARY_COLOURS ? &out->detectable_colour_bias
									    : &out->detectable_other_bias;
		*kind = fmax(*kind, detectable);
		if (p < out->p) {
			out->p = p;
			out->worst_function = f;
		}
	}
}

static void parse_mutation(const char *text, struct mixture_entry *out)
{
	struct mixture m;
	struct error e = {""};
	if (mixture_parse(text, &m, &e)) {
		fprintf(stderr, "%s\n", e.text);
		abort();
	}
	*out = m.entries[0];
}

static void run_groups(struct group *groups)
{
	struct queue q = {groups, 0};
	pthread_t other;
	bool has_second_thread = pthread_create(&other, NULL, run_queued_groups, &q) == 0;
	run_queued_groups(&q);
	if (has_second_thread)
		pthread_join(other, NULL);
}

static void add_group(const struct group *group, struct stationary_result *out)
{
	out->starts += group->starts;
	out->proposals += group->proposals;
	out->accepted += group->accepted;
	out->checked_states += group->checked_states;
	for (int i = 0; i < BATCH_COUNTERS; i++)
		out->counters[i] += group->counters[i];
	for (int i = 0; i < STRATEGY_COUNTERS; i++)
		out->strategy[i] += group->strategy[i];
	if (group->failure[0])
		memcpy(out->failure, group->failure, sizeof out->failure);
}

void stationary_disable_roulette(struct world *w)
{
	w->settings.roulette_depth = PATH_EDGES_MAX;
}

void stationary_run_with_starts(const struct world *w, const char *test, const struct stationary_options *options,
				struct stationary_starts *starts_cache, struct stationary_result *out)
{
	struct group *groups = calloc(STATIONARY_GROUPS, sizeof *groups);
	uint32_t scale = test_scale(), starts = options->starts / scale ? options->starts / scale : 1;
	struct mixture_entry entry;
	char name[160];
	bool has_starts = starts_cache->indices;
	snprintf(name, sizeof name, "%s %s %u..%u", test, options->mutation, options->min_edges, options->max_edges);
	parse_mutation(options->mutation, &entry);
	*out = (struct stationary_result){.worst_function = -1};
	if (!has_starts) {
		starts_cache->indices = calloc((size_t)STATIONARY_GROUPS * starts, sizeof *starts_cache->indices);
		starts_cache->seed = stats_seed(name);
	}
	for (uint32_t g = 0; g < STATIONARY_GROUPS; g++) {
		groups[g].w = w;
		groups[g].options = options;
		groups[g].entry = &entry;
		groups[g].seed = stats_seed(name);
		groups[g].start_seed = starts_cache->seed;
		groups[g].number = g;
		groups[g].starts = starts;
		groups[g].bootstrap = options->bootstrap / scale > 16 ? options->bootstrap / scale : 16;
		groups[g].has_starts = has_starts;
		groups[g].start_indices = starts_cache->indices + (size_t)g * starts;
		groups[g].weight = starts_cache->weight[g];
	}
	double begin = cpu_seconds();
	run_groups(groups);
	out->cpu_seconds = cpu_seconds() - begin;
	for (int g = 0; g < STATIONARY_GROUPS; g++) {
		starts_cache->weight[g] = groups[g].weight;
		add_group(&groups[g], out);
	}
	judge_groups(groups, out);
	out->accepted_share = (double)out->accepted / (double)(out->accepted + out->starts);
	free(groups);
}

void stationary_starts_fini(struct stationary_starts *s)
{
	free(s->indices);
	s->indices = NULL;
}

void stationary_run(const struct world *w, const char *test, const struct stationary_options *options,
		    struct stationary_result *out)
{
	struct stationary_starts own_starts = {.indices = NULL};
	stationary_run_with_starts(w, test, options, &own_starts, out);
	stationary_starts_fini(&own_starts);
}

bool stationary_passes(const struct stationary_result *r)
{
	return r->p > LEVEL && !r->failure[0] &&
	       r->counters[COUNT_NAN] + r->counters[COUNT_INFINITE] + r->counters[COUNT_NEGATIVE] == 0;
}
