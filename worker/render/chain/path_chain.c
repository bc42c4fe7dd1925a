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
#include "worker/render/chain/path_place.h"
#include "worker/render/mutation/mixture.h"
#include "worker/render/path/classes.h"
#include "worker/render/path/integrator.h"

#include <string.h>

struct path_chain {
	struct chain base;
	struct mixture mixture;
	struct mutation_ctx mutation;
	struct path_place place[2];
	/* The proposal's path equals the current one between steps. */
	struct path_place *current, *proposal;
	/* The path with which the epoch began, as bytes. */
	size_t began_size;
	uint8_t began[PATH_BYTES_MAX];
};

static struct path_chain *path_of(struct chain *c)
{
	return (struct path_chain *)(void *)c;
}

static void set_up(struct path_chain *c)
{
	struct error ignored;
	/* The plan was checked when the lease arrived. */
	mixture_parse(c->base.mixture, &c->mixture, &ignored);
	c->current = &c->place[0];
	c->proposal = &c->place[1];
	c->current->weight = c->proposal->weight = 0;
	c->mutation.path = c->base.context;
	c->mutation.seed = c->base.seed;
	c->mutation.chain = c->base.id;
	c->mutation.limits = walk_limits_of(&c->base.context->w->accuracy);
}

/* Begins an epoch with the current path, and keeps its bytes for save(). */
static void begin(struct path_chain *c, const uint8_t *bytes, size_t size)
{
	memcpy(c->began, bytes, size);
	c->began_size = size;
	path_place_copy(&c->proposal->path, &c->current->path);
}

static bool start(struct chain *base, uint64_t bootstrap_index)
{
	static const struct full_path black = {0};
	struct path_chain *c = path_of(base);
	uint8_t bytes[PATH_BYTES_MAX];
	set_up(c);
	c->current->path.edges = 0;
	bool ok = bootstrap_index == UINT64_MAX ||
		  path_start(base->context, base->seed, bootstrap_index, &c->current->path);
	size_t size = path_write(base->context, &c->current->path, &c->proposal->path, bytes);
	if (size == 0)
		size = path_write(base->context, &black, &c->proposal->path, bytes);
	begin(c, bytes, size);
	return ok;
}

static bool resume(struct chain *base, const struct chain_state *state)
{
	struct path_chain *c = path_of(base);
	set_up(c);
	if (!chain_get_head(base, state->bytes, state->size))
		return false;
	const uint8_t *bytes = state->bytes + CHAIN_STATE_HEAD;
	size_t size = state->size - CHAIN_STATE_HEAD;
	if (!path_read(base->context, bytes, size, &c->current->path))
		return false;
	begin(c, bytes, size);
	return true;
}

static int save(struct chain *base, struct chain_state *out)
{
	struct path_chain *c = path_of(base);
	uint8_t bytes[CHAIN_STATE_HEAD + PATH_BYTES_MAX];
	_Static_assert(sizeof bytes <= CHAIN_STATE_MAX, "a coordinator would refuse it");
	size_t size = path_write(base->context, &c->current->path, &c->proposal->path, bytes + CHAIN_STATE_HEAD);
	if (size == 0) {
		base->context->counters[COUNT_STATES_LOST]++;
		size = c->began_size;
		memcpy(bytes + CHAIN_STATE_HEAD, c->began, size);
	}
	path_place_copy(&c->proposal->path, &c->current->path);
	chain_put_head(base, bytes);
	return chain_give(bytes, CHAIN_STATE_HEAD + size, out);
}

static void splat(struct path_chain *c, struct path_place *at)
{
	if (at->weight == 0)
		return;
	struct splat s = {.x = at->path.film[0], .y = at->path.film[1]};
	full_path_colour(c->base.context, &at->path, s.xyz);
	film_sums_splat(c->base.film, &s, at->weight);
	chain_moments_state(&c->base.film->moments, &s, 1, 1, at->weight);
	chain_moments_class(&c->base.film->moments, path_class_whole(&at->path), at->weight);
	at->weight = 0;
}

static void flush(struct chain *base)
{
	splat(path_of(base), path_of(base)->current);
}

/* Returns the acceptance probability; 0 if there is no valid proposal, the reason for which is counted. */
static double propose(struct path_chain *c, const struct mixture_entry *entry, struct move *move,
		      struct chain_sums *sums)
{
	struct mutation_ctx *m = &c->mutation;
	struct full_path *x = &c->current->path, *y = &c->proposal->path;
	enum proposal_end end = entry->ops->propose(entry->ops, m, &entry->how, x, y, move);
	double to_y = end ? -INFINITY : entry->ops->log_weight(m, y, move, X_TO_Y);
	if (!end && !(to_y > -INFINITY && path_place_is_sound(m->path, to_y, entry->ops->independent)))
		end = PROPOSAL_DARK;
	if (end) {
		m->count[proposal_counter(end)]++;
		return 0;
	}
	if (entry->ops->independent) {
		double f_over_p = exp(to_y);
		sums->sum += f_over_p;
		sums->square += f_over_p * f_over_p;
	}
	if (x->edges == 0)
		return 1;
	double to_x = entry->ops->log_weight(m, x, move, Y_TO_X);
	return path_place_is_sound(m->path, to_x, false) ? exp(fmin(to_y - to_x, 0)) : 0;
}

static void step(struct chain *base, struct chain_sums *sums)
{
	struct path_chain *c = path_of(base);
	struct mutation_ctx *m = &c->mutation;
	uint64_t *counters = base->context->counters;
	double r[4];
	m->step = ++base->step;
	mutation_random(m, BLOCK_STRATEGY, r);
	bool black = c->current->path.edges == 0;
	unsigned chosen = black ? c->mixture.independent : mixture_choose(&c->mixture, r[0]);
	const struct mixture_entry *entry = &c->mixture.entry[chosen];
	m->count = base->strategy[chosen];
	m->count[STRATEGY_PROPOSED]++;
	counters[COUNT_SAMPLES]++;
	counters[COUNT_INDEPENDENT] += entry->ops->independent;
	struct move move = {0};
	uint64_t before = batch_rays(counters);
	double a = propose(c, entry, &move, sums);
	m->count[STRATEGY_RAYS] += batch_rays(counters) - before;
	bool accepted = r[1] < a;
	chain_count(base, accepted);
	if (!black)
		c->current->weight += 1 - a;
	c->proposal->weight = a;
	if (accepted) {
		m->count[STRATEGY_ACCEPTED]++;
		splat(c, c->current);
		struct path_place *swap = c->current;
		c->current = c->proposal;
		c->proposal = swap;
	} else {
		splat(c, c->proposal);
	}
	path_place_follow(&c->proposal->path, &c->current->path, &move, entry->ops->independent);
}

static const struct chain_ops chain_path = {
	.size = sizeof(struct path_chain),
	.start = start,
	.resume = resume,
	.step = step,
	.flush = flush,
	.save = save,
};

const struct integrator integrator_hslt = {
	.face = {"hslt", PLAN_CHAINS, FULL_PATH_MAX_EDGES, .has_mutations = true, .to_emitters = true},
	.stream = RNG_BOOTSTRAP,
	.evaluate = path_bootstrap,
	.chain = &chain_path,
};
