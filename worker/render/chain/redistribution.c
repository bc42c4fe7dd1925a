/* SPDX-License-Identifier: Apache-2.0 */
/*
 * bdpt calls redistribute_contribution() for each contribution of a sample. Nearly all are below the threshold and are
 * left as they are. For the others, redistribute_contribution() builds the full path x, because the share that is
 * spread depends on the path alone, not on the roulette of the sub-paths, which stays a factor of the weight. Then
 * run_chain() runs the chains: it proposes y by a local mutation, accepts it with probability min(1, h(y) T(y -> x) /
 * (h(x) T(x -> y))), and splats both states with their expected weights.
 *
 * Failures: redistribution_new fails if memory runs out; afterwards nothing allocates or fails. One path in millions
 * cannot be built again from its sub-paths; it keeps its contribution and starts no chain, and so does one whose
 * brightness relative to the map is not finite. Proposals with a density that is not finite are counted and rejected.
 */
#include "worker/render/chain/redistribution.h"

#include "common/base/liveness.h"
#include "common/base/mem.h"
#include "worker/render/chain/path_state.h"
#include "worker/render/math/logsum.h"
#include "worker/render/mutation/mixture.h"
#include "worker/render/path/classes.h"
#include "worker/render/path/full_path_density.h"
#include "worker/render/world/build.h"

/* Relative MSE times CPU time for other values: tests/bench/choices.md, "Energy redistribution". */
const struct redistribution_rule redistribution_default_rule = {
	.threshold = 4, .mutations_per_unit = 2, .chain_length = 256};

struct redistribution_state {
	struct path_state state;
	double scale;	       /* w */
	double chain_fraction; /* 1 - a; 0: the film gets everything */
};

struct redistribution {
	struct path_split split; /* must be first: redistribute_contribution() gets its address */
	struct redistribution_rule rule;
	struct path_context context;	 /* of the chains */
	uint32_t light_subpath_interval; /* of the samples */
	const struct brightness *map;
	struct splat_target *target;
	struct mixture mixture; /* local strategies only */
	struct mutation_ctx mutation;
	uint64_t unused_counters[STRATEGY_COUNTERS];
	uint64_t pixel, sample;
	double redistributed_intensity, *class_intensity;
	struct redistribution_state start, states[2];
};

/* Whether some inner vertex is not specular. */
static bool has_nonspecular_vertex(const struct full_path *x)
{
	for (unsigned j = 1; j < x->edges; j++)
		if (!x->v[j].is_delta)
			return true;
	return false;
}

/* Computes w and the share 1 - a of this path's contribution that is spread. */
static void compute_weight(struct redistribution *r, struct redistribution_state *state)
{
	double log_pdf[FULL_PATH_VERTICES_MAX];
	struct full_path *x = &state->state.path;
	state->scale = brightness_inverse_at(r->map, x->film[0], x->film[1]);
	state->chain_fraction = 0;
	if (!has_nonspecular_vertex(x))
		return;
	full_path_log_technique_pdfs(&r->context, x, log_pdf);
	for (unsigned j = 2; j <= x->edges && r->light_subpath_interval > 1; j++)
		log_pdf[j] -= log(r->light_subpath_interval);
	double u = state->scale * exp(full_path_log_f(&r->context, x) - log_sum_exp(log_pdf, x->edges + 1));
	if (isgreater(u, r->rule.threshold))
		state->chain_fraction = 1 - r->rule.threshold / u;
}

static void splat_state(struct redistribution *r, struct redistribution_state *state, double unit)
{
	if (state->state.weight == 0)
		return;
	struct splat s = {.x = state->state.path.film[0], .y = state->state.path.film[1]};
	full_path_colour(&r->context, &state->state.path, s.xyz);
	r->target->add_splat(r->target, &s, state->state.weight * unit / state->scale);
	state->state.weight = 0;
}

/* Returns the acceptance probability. */
static double propose(struct redistribution *r, const struct mixture_entry *entry, struct proposal_move *move,
		      struct redistribution_state *x, struct redistribution_state *y)
{
	struct mutation_ctx *m = &r->mutation;
	if (entry->ops->propose(entry->ops, m, &entry->forced, &x->state.path, &y->state.path, move))
		return 0;
	double to_y = entry->ops->log_weight(m, &y->state.path, move, MUTATION_FORWARD);
	if (!(to_y > -INFINITY && path_state_weight_is_valid(m->path, to_y, false)))
		return 0;
	compute_weight(r, y);
	if (!(y->chain_fraction > 0))
		return 0;
	double to_x = entry->ops->log_weight(m, &x->state.path, move, MUTATION_REVERSE);
	if (!path_state_weight_is_valid(m->path, to_x, false))
		return 0;
	return exp(fmin(to_y - to_x + log(y->scale * y->chain_fraction / (x->scale * x->chain_fraction)), 0));
}

/* Runs one chain from the path `start`; each mutation splats `unit` times the brightness of its place. */
static void run_chain(struct redistribution *r, const struct redistribution_state *start, double unit)
{
	struct redistribution_state *x = &r->states[0], *y = &r->states[1];
	struct mutation_ctx *m = &r->mutation;
	path_state_copy(&x->state.path, &start->state.path);
	path_state_copy(&y->state.path, &start->state.path);
	x->scale = start->scale;
	x->chain_fraction = start->chain_fraction;
	x->state.weight = y->state.weight = 0;
	liveness_tick();
	for (uint32_t i = 0; i < r->rule.chain_length; i++) {
		double u[4];
		struct proposal_move move = {0};
		m->step = i;
		mutation_draw_uniforms(m, BLOCK_STRATEGY, u);
		double acceptance = propose(r, &r->mixture.entries[mixture_choose(&r->mixture, u[0])], &move, x, y);
		x->state.weight += 1 - acceptance;
		y->state.weight = acceptance;
		if (u[1] < acceptance) {
			struct redistribution_state *swap = x;
			splat_state(r, x, unit);
			x = y;
			y = swap;
		} else {
			splat_state(r, y, unit);
		}
		path_state_sync_proposal(&y->state.path, &x->state.path, &move, false);
	}
	splat_state(r, x, unit);
}

/* Returns the number of chains for `units` times the energy that one chain carries, and sets the factor *energy_factor
 * on their energy. For less than one unit: one chain with that probability, otherwise none. */
static unsigned choose_chain_count(double units, double u, double *energy_factor)
{
	if (units < 1) {
		*energy_factor = 1;
		return u < units;
	}
	double n = fmin(floor(units), REDISTRIBUTION_CHAINS_MAX);
	*energy_factor = units / n;
	return (unsigned)n;
}

static spectrum redistribute_contribution(struct path_split *split, struct path_context *c, unsigned s, unsigned t,
					  const double film[2], spectrum l)
{
	struct redistribution *r = (struct redistribution *)(void *)split;
	struct redistribution_state *x = &r->start;
	double intensity = path_intensity(c, l), relative = intensity * brightness_inverse_at(r->map, film[0], film[1]);
	if (!isgreater(relative, r->rule.threshold) || !isfinite(relative) ||
	    !full_path_from_subpaths(c, s, c->passed_count, s + t - 1 + c->passed_count, &x->state.path))
		return l;
	compute_weight(r, x);
	if (!(x->chain_fraction > 0))
		return l;
	const double fraction = x->chain_fraction, chain_energy = r->rule.chain_length / r->rule.mutations_per_unit;
	double u[4], energy_factor;
	uint64_t id[4];
	const uint64_t technique = s * (PATH_EDGES_MAX + 2) + t;
	rng_uniform4(r->mutation.seed, RNG_REDISTRIBUTION, r->pixel, r->sample, technique * 2, u);
	unsigned n = choose_chain_count(fraction * relative / chain_energy, u[0], &energy_factor);
	r->redistributed_intensity += fraction * intensity;
	r->class_intensity[full_path_class(&x->state.path)] += fraction * intensity;
	c->counters[COUNT_REDISTRIBUTED]++;
	c->counters[COUNT_REDISTRIBUTION_MUTATIONS] += (uint64_t)n * r->rule.chain_length;
	rng_bits4(r->mutation.seed, RNG_REDISTRIBUTION, r->pixel, r->sample, technique * 2 + 1, id);
	const uint64_t rays_before = batch_ray_count(c->counters);
	for (unsigned k = 0; k < n; k++) {
		r->mutation.chain = id[0] + k;
		run_chain(r, x, energy_factor / r->rule.mutations_per_unit / (c->window.width * c->window.height));
	}
	c->counters[COUNT_REDISTRIBUTION_RAYS] += batch_ray_count(c->counters) - rays_before;
	return spectrum_scale(1 - fraction, l);
}

/* Removes independent strategies: they ignore the current path, so they would not keep the energy near it. */
static void remove_independent(struct mixture *m)
{
	unsigned n = 0;
	m->total_weight = 0;
	for (unsigned i = 0; i < m->count; i++) {
		if (m->entries[i].ops->is_independent)
			continue;
		m->total_weight += m->entries[i].weight;
		m->entries[n++] = m->entries[i];
	}
	m->count = n;
}

int redistribution_new(struct redistribution **out, const struct redistribution_rule *rule,
		       const struct path_context *c, const struct brightness *map, uint64_t seed,
		       struct splat_target *target, double classes[PATH_CLASSES], struct error *e)
{
	struct render_summary summary;
	struct redistribution *r = *out = mem_alloc(1, sizeof *r);
	if (!r)
		return error_set(e, ENOMEM, "no memory for chains");
	r->split.film_part = redistribute_contribution;
	r->rule = *rule;
	r->context = *c;
	r->context.max_survival = 0;
	r->context.light_subpath_interval = 0;
	r->light_subpath_interval = c->light_subpath_interval;
	r->map = map;
	r->target = target;
	r->class_intensity = classes;
	world_summary(c->w, &summary);
	mixture_init_default(&summary, &r->mixture);
	remove_independent(&r->mixture);
	r->mutation.path = &r->context;
	r->mutation.seed = seed;
	r->mutation.counters = r->unused_counters;
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
	r->redistributed_intensity = 0;
	return &r->split;
}

double redistribution_taken_intensity(const struct redistribution *r)
{
	return r->redistributed_intensity;
}
