/* SPDX-License-Identifier: Apache-2.0 */
/*
 * bdpt calls keep() for each contribution of a sample. Nearly all are below the threshold and are left as they are.
 * For the others, keep() builds the full path x, because the share that is spread depends on the path alone, not on
 * the roulette of the sub-paths, which stays a factor of the weight. Then run_chain() runs the chains: it proposes y
 * by a local mutation, accepts it with probability min(1, h(y) T(y -> x) / (h(x) T(x -> y))), and splats both states
 * with their expected weights.
 *
 * Failures: redistribution_new fails if memory runs out; afterwards nothing allocates or fails. One path in millions
 * cannot be built again from its sub-paths; it keeps its contribution and starts no chain, and so does one whose
 * brightness relative to the map is not finite. Proposals with a density that is not finite are counted and rejected.
 */
#include "worker/render/chain/redistribution.h"

#include "common/base/liveness.h"
#include "common/base/mem.h"
#include "worker/render/chain/path_place.h"
#include "worker/render/math/logsum.h"
#include "worker/render/mutation/mixture.h"
#include "worker/render/path/classes.h"
#include "worker/render/path/full_path_density.h"
#include "worker/render/world/build.h"

/* Relative MSE times CPU time for other values: tests/bench/choices.md, "Energy redistribution". */
const struct redistribution_rule redistribution_usual = {.threshold = 4, .mutations = 2, .length = 256};

struct spread_place {
	struct path_place place;
	double scale; /* w */
	double share; /* 1 - a; 0: the film gets everything */
};

struct redistribution {
	struct path_split split; /* must be first: keep() gets its address */
	struct redistribution_rule rule;
	struct path_context context; /* context of the chains */
	uint32_t light_every;	     /* light_every of the samples */
	const struct brightness *map;
	struct splat_target *to;
	struct mixture mixture; /* local strategies only */
	struct mutation_ctx mutation;
	uint64_t unread[STRATEGY_COUNTERS];
	uint64_t pixel, sample;
	double taken, *classes;
	struct spread_place start, places[2];
};

/* Whether some inner vertex is not specular. */
static bool is_scattered(const struct full_path *x)
{
	for (unsigned j = 1; j < x->edges; j++)
		if (!x->v[j].delta)
			return true;
	return false;
}

/* Computes w and the share 1 - a of this path's contribution that is spread. */
static void compute_weight(struct redistribution *r, struct spread_place *at)
{
	double log_pdf[FULL_PATH_MAX_VERTICES];
	struct full_path *x = &at->place.path;
	at->scale = brightness_scale(r->map, x->film[0], x->film[1]);
	at->share = 0;
	if (!is_scattered(x))
		return;
	full_path_log_techniques(&r->context, x, log_pdf);
	for (unsigned j = 2; j <= x->edges && r->light_every > 1; j++)
		log_pdf[j] -= log(r->light_every);
	double u = at->scale * exp(full_path_log_f(&r->context, x) - log_sum_exp(log_pdf, x->edges + 1));
	if (isgreater(u, r->rule.threshold))
		at->share = 1 - r->rule.threshold / u;
}

static void splat(struct redistribution *r, struct spread_place *at, double unit)
{
	if (at->place.weight == 0)
		return;
	struct splat s = {.x = at->place.path.film[0], .y = at->place.path.film[1]};
	full_path_colour(&r->context, &at->place.path, s.xyz);
	r->to->splat(r->to, &s, at->place.weight * unit / at->scale);
	at->place.weight = 0;
}

/* Returns the acceptance probability. */
static double propose(struct redistribution *r, const struct mixture_entry *entry, struct move *move,
		      struct spread_place *x, struct spread_place *y)
{
	struct mutation_ctx *m = &r->mutation;
	if (entry->ops->propose(entry->ops, m, &entry->how, &x->place.path, &y->place.path, move))
		return 0;
	double to_y = entry->ops->log_weight(m, &y->place.path, move, X_TO_Y);
	if (!(to_y > -INFINITY && path_place_is_sound(m->path, to_y, false)))
		return 0;
	compute_weight(r, y);
	if (!(y->share > 0))
		return 0;
	double to_x = entry->ops->log_weight(m, &x->place.path, move, Y_TO_X);
	if (!path_place_is_sound(m->path, to_x, false))
		return 0;
	return exp(fmin(to_y - to_x + log(y->scale * y->share / (x->scale * x->share)), 0));
}

/* Runs one chain from the path `from`; each mutation splats `unit` times the brightness of its place. */
static void run_chain(struct redistribution *r, const struct spread_place *from, double unit)
{
	struct spread_place *x = &r->places[0], *y = &r->places[1];
	struct mutation_ctx *m = &r->mutation;
	path_place_copy(&x->place.path, &from->place.path);
	path_place_copy(&y->place.path, &from->place.path);
	x->scale = from->scale;
	x->share = from->share;
	x->place.weight = y->place.weight = 0;
	liveness_tick();
	for (uint32_t i = 0; i < r->rule.length; i++) {
		double u[4];
		struct move move = {0};
		m->step = i;
		mutation_random(m, BLOCK_STRATEGY, u);
		double a = propose(r, &r->mixture.entry[mixture_choose(&r->mixture, u[0])], &move, x, y);
		x->place.weight += 1 - a;
		y->place.weight = a;
		if (u[1] < a) {
			struct spread_place *swap = x;
			splat(r, x, unit);
			x = y;
			y = swap;
		} else {
			splat(r, y, unit);
		}
		path_place_follow(&y->place.path, &x->place.path, &move, false);
	}
	splat(r, x, unit);
}

/* Returns the number of chains for `units` times the energy that one chain carries, and sets the factor *each on their
 * energy. For less than one unit: one chain with that probability, otherwise none. */
static unsigned chains_for(double units, double u, double *each)
{
	if (units < 1) {
		*each = 1;
		return u < units;
	}
	double n = fmin(floor(units), REDISTRIBUTION_CHAINS);
	*each = units / n;
	return (unsigned)n;
}

static spectrum keep(struct path_split *split, struct path_context *c, unsigned s, unsigned t, const double film[2],
		     spectrum l)
{
	struct redistribution *r = (struct redistribution *)(void *)split;
	struct spread_place *x = &r->start;
	double intensity = path_intensity(c, l), relative = intensity * brightness_scale(r->map, film[0], film[1]);
	if (!isgreater(relative, r->rule.threshold) || !isfinite(relative) ||
	    !full_path_from_subpaths(c, s, c->passed_count, s + t - 1 + c->passed_count, &x->place.path))
		return l;
	compute_weight(r, x);
	if (!(x->share > 0))
		return l;
	const double share = x->share, carries = r->rule.length / r->rule.mutations;
	double u[4], each;
	uint64_t id[4];
	const uint64_t technique = s * (PATH_MAX_EDGES + 2) + t;
	rng_uniform4(r->mutation.seed, RNG_REDISTRIBUTION, r->pixel, r->sample, technique * 2, u);
	unsigned n = chains_for(share * relative / carries, u[0], &each);
	r->taken += share * intensity;
	r->classes[path_class_whole(&x->place.path)] += share * intensity;
	c->counters[COUNT_SPREAD]++;
	c->counters[COUNT_SPREAD_MUTATIONS] += (uint64_t)n * r->rule.length;
	rng_bits4(r->mutation.seed, RNG_REDISTRIBUTION, r->pixel, r->sample, technique * 2 + 1, id);
	const uint64_t rays = batch_rays(c->counters);
	for (unsigned k = 0; k < n; k++) {
		r->mutation.chain = id[0] + k;
		run_chain(r, x, each / r->rule.mutations / (c->window.width * c->window.height));
	}
	c->counters[COUNT_SPREAD_RAYS] += batch_rays(c->counters) - rays;
	return spectrum_scale(1 - share, l);
}

/* Removes independent strategies: they ignore the current path, so they would not keep the energy near it. */
static void leave_out_independent(struct mixture *m)
{
	unsigned n = 0;
	m->total = 0;
	for (unsigned i = 0; i < m->count; i++) {
		if (m->entry[i].ops->independent)
			continue;
		m->total += m->entry[i].weight;
		m->entry[n++] = m->entry[i];
	}
	m->count = n;
}

int redistribution_new(struct redistribution **out, const struct redistribution_rule *rule,
		       const struct path_context *c, const struct brightness *map, uint64_t seed,
		       struct splat_target *to, double classes[PATH_CLASSES], struct error *e)
{
	struct render_summary summary;
	struct redistribution *r = *out = mem_alloc(1, sizeof *r);
	if (!r)
		return error_set(e, ENOMEM, "no memory for chains");
	r->split.keep = keep;
	r->rule = *rule;
	r->context = *c;
	r->context.roulette = 0;
	r->context.light_every = 0;
	r->light_every = c->light_every;
	r->map = map;
	r->to = to;
	r->classes = classes;
	world_summary(c->w, &summary);
	mixture_default(&summary, &r->mixture);
	leave_out_independent(&r->mixture);
	r->mutation.path = &r->context;
	r->mutation.seed = seed;
	r->mutation.count = r->unread;
	r->mutation.limits = walk_limits_of(&c->w->accuracy);
	return 0;
}

void redistribution_free(struct redistribution *r)
{
	mem_free(r);
}

struct path_split *redistribution_begin(struct redistribution *r, uint64_t pixel, uint64_t sample)
{
	r->pixel = pixel;
	r->sample = sample;
	r->taken = 0;
	return &r->split;
}

double redistribution_taken(const struct redistribution *r)
{
	return r->taken;
}
