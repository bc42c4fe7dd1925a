/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Improved half vector space light transport (Hanika, Kaplanyan, Dachsbacher 2015): chains whose states are whole
 * paths, moved by a mixture of mutations (Veach and Guibas 1997; worker/render/mutation). The target is I = X+Y+Z of
 * the path's contribution per area; independent proposals also estimate b by f / T. The bootstrap is that of bdpt.
 *
 * A step draws a strategy of the mixture, lets it change a copy of the state, and accepts the proposal with probability
 * min(1, ratio of the weights). A state that the chain leaves is splatted with its accumulated weight. At the end of an
 * epoch the state is saved as bytes (path_bytes.c), from which the next epoch resumes.
 *
 * A proposal whose density is zero, not finite or out of range is counted by its reason and rejected. A state that
 * cannot be resumed fails the lease (-EILSEQ).
 */
#include "worker/render/chain/chain.h"

#include "worker/render/chain/path_bytes.h"
#include "worker/render/chain/path_state.h"
#include "worker/render/mutation/mixture.h"
#include "worker/render/path/classes.h"
#include "worker/render/path/integrator.h"

#include <string.h>

struct path_chain {
	struct chain base;
	struct mixture mixture;
	struct mutation_ctx mutation;
	struct path_state states[2];
	/* The proposal's path equals the current one between steps. */
	struct path_state *current, *proposal;
	/* The path with which the epoch began, as bytes. */
	size_t epoch_start_size;
	uint8_t epoch_start[PATH_BYTES_MAX];
};

static struct path_chain *path_chain_of(struct chain *c)
{
	return (struct path_chain *)(void *)c;
}

static void init_chain(struct path_chain *c)
{
	struct error ignored;
	/* The plan was checked when the lease arrived. */
	mixture_parse(c->base.mixture, &c->mixture, &ignored);
	c->current = &c->states[0];
	c->proposal = &c->states[1];
	c->current->weight = c->proposal->weight = 0;
	c->mutation.path = c->base.context;
	c->mutation.seed = c->base.seed;
	c->mutation.chain = c->base.id;
	c->mutation.limits = walk_limits_of(&c->base.context->w->accuracy);
}

/* Begins an epoch with the current path, and keeps its bytes for save(). */
static void begin_epoch(struct path_chain *c, const uint8_t *bytes, size_t size)
{
	memcpy(c->epoch_start, bytes, size);
	c->epoch_start_size = size;
	path_state_copy(&c->proposal->path, &c->current->path);
}

static bool start(struct chain *base, uint64_t bootstrap_index)
{
	static const struct full_path black = {0};
	struct path_chain *c = path_chain_of(base);
	uint8_t bytes[PATH_BYTES_MAX];
	init_chain(c);
	c->current->path.edges = 0;
	bool ok = bootstrap_index == UINT64_MAX ||
		  path_choose_seed(base->context, base->seed, bootstrap_index, &c->current->path);
	size_t size = path_write(base->context, &c->current->path, &c->proposal->path, bytes);
	if (size == 0)
		size = path_write(base->context, &black, &c->proposal->path, bytes);
	begin_epoch(c, bytes, size);
	return ok;
}

static bool resume(struct chain *base, const struct chain_state *state)
{
	struct path_chain *c = path_chain_of(base);
	init_chain(c);
	if (!chain_read_header(base, state->bytes, state->size))
		return false;
	const uint8_t *bytes = state->bytes + CHAIN_STATE_HEADER_BYTES;
	size_t size = state->size - CHAIN_STATE_HEADER_BYTES;
	if (!path_read(base->context, bytes, size, &c->current->path))
		return false;
	begin_epoch(c, bytes, size);
	return true;
}

static int save(struct chain *base, struct chain_state *out)
{
	struct path_chain *c = path_chain_of(base);
	uint8_t bytes[CHAIN_STATE_HEADER_BYTES + PATH_BYTES_MAX];
	_Static_assert(sizeof bytes <= CHAIN_STATE_MAX, "a coordinator would refuse it");
	size_t size =
		path_write(base->context, &c->current->path, &c->proposal->path, bytes + CHAIN_STATE_HEADER_BYTES);
	if (size == 0) {
		base->context->counters[COUNT_STATES_LOST]++;
		size = c->epoch_start_size;
		memcpy(bytes + CHAIN_STATE_HEADER_BYTES, c->epoch_start, size);
	}
	path_state_copy(&c->proposal->path, &c->current->path);
	chain_write_header(base, bytes);
	return chain_state_copy_bytes(bytes, CHAIN_STATE_HEADER_BYTES + size, out);
}

static void splat_state(struct path_chain *c, struct path_state *state)
{
	if (state->weight == 0)
		return;
	struct splat s = {.x = state->path.film[0], .y = state->path.film[1]};
	full_path_colour(c->base.context, &state->path, s.xyz);
	film_sums_splat(c->base.film, &s, state->weight);
	chain_moments_add_state(&c->base.film->moments, &s, 1, 1, state->weight);
	chain_moments_add_class(&c->base.film->moments, full_path_class(&state->path), state->weight);
	state->weight = 0;
}

static void flush(struct chain *base)
{
	splat_state(path_chain_of(base), path_chain_of(base)->current);
}

/* Returns the acceptance probability; 0 if there is no valid proposal, the reason for which is counted. */
static double propose(struct path_chain *c, const struct mixture_entry *entry, struct proposal_move *move,
		      struct chain_sums *sums)
{
	struct mutation_ctx *m = &c->mutation;
	struct full_path *x = &c->current->path, *y = &c->proposal->path;
	enum proposal_result result = entry->ops->propose(entry->ops, m, &entry->forced, x, y, move);
	double to_y = result ? -INFINITY : entry->ops->log_weight(m, y, move, MUTATION_FORWARD);
	if (!result && !(to_y > -INFINITY && path_state_weight_is_valid(m->path, to_y, entry->ops->is_independent)))
		result = PROPOSAL_BLACK;
	if (result) {
		m->counters[proposal_counter(result)]++;
		return 0;
	}
	if (entry->ops->is_independent) {
		double f_over_p = exp(to_y);
		sums->sum += f_over_p;
		sums->square_sum += f_over_p * f_over_p;
	}
	if (x->edges == 0)
		return 1;
	double to_x = entry->ops->log_weight(m, x, move, MUTATION_REVERSE);
	return path_state_weight_is_valid(m->path, to_x, false) ? exp(fmin(to_y - to_x, 0)) : 0;
}

static void step(struct chain *base, struct chain_sums *sums)
{
	struct path_chain *c = path_chain_of(base);
	struct mutation_ctx *m = &c->mutation;
	uint64_t *counters = base->context->counters;
	double r[4];
	m->step = ++base->step;
	mutation_draw_uniforms(m, BLOCK_STRATEGY, r);
	bool black = c->current->path.edges == 0;
	unsigned strategy = black ? c->mixture.independent_index : mixture_choose(&c->mixture, r[0]);
	const struct mixture_entry *entry = &c->mixture.entries[strategy];
	m->counters = base->strategy_counters[strategy];
	m->counters[STRATEGY_PROPOSED]++;
	counters[COUNT_SAMPLES]++;
	counters[COUNT_INDEPENDENT] += entry->ops->is_independent;
	struct proposal_move move = {0};
	uint64_t rays_before = batch_ray_count(counters);
	double acceptance = propose(c, entry, &move, sums);
	m->counters[STRATEGY_RAYS] += batch_ray_count(counters) - rays_before;
	bool accepted = r[1] < acceptance;
	chain_count_decision(base, accepted);
	if (!black)
		c->current->weight += 1 - acceptance;
	c->proposal->weight = acceptance;
	if (accepted) {
		m->counters[STRATEGY_ACCEPTED]++;
		splat_state(c, c->current);
		struct path_state *swap = c->current;
		c->current = c->proposal;
		c->proposal = swap;
	} else {
		splat_state(c, c->proposal);
	}
	path_state_sync_proposal(&c->proposal->path, &c->current->path, &move, entry->ops->is_independent);
}

static const struct chain_ops chain_ops_path = {
	.size = sizeof(struct path_chain),
	.start = start,
	.resume = resume,
	.step = step,
	.flush = flush,
	.save = save,
};

const struct integrator integrator_hslt = {
	.properties = {"hslt", PLAN_CHAINS, FULL_PATH_EDGES_MAX, .has_mutations = true, .must_end_on_emitter = true},
	.stream = RNG_BOOTSTRAP,
	.evaluate = path_evaluate_bootstrap,
	.chain = &chain_ops_path,
};
