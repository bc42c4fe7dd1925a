/* SPDX-License-Identifier: Apache-2.0 */
/* Primary sample space Metropolis light transport (Kelemen et al. 2002), over the bidirectional path tracer. */
#include "worker/render/chain/chain.h"
#include "worker/render/chain/pss.h"
#include "worker/render/math/fptrap.h"
#include "worker/render/path/integrate_bdpt.h"
#include "worker/render/path/integrator.h"

#include <assert.h>

/* The fraction of independent proposals. */
#define LARGE_STEP_PROBABILITY 0.3

struct pss_state {
	struct pss_point point;
	struct path_sample sample;
	double weight; /* accumulated but not yet splatted */
};

struct pss_chain {
	struct chain base;
	struct pss_state states[2];
	struct pss_state *current, *proposal;
};

static struct pss_chain *pss_chain_of(struct chain *c)
{
	return (struct pss_chain *)(void *)c;
}

static void evaluate(struct pss_chain *c, struct pss_sampler *s, struct pss_state *state)
{
	c->base.integrator->evaluate(c->base.context, &s->base, &state->sample);
	state->weight = 0;
}

static void set_states(struct pss_chain *c)
{
	c->current = &c->states[0];
	c->proposal = &c->states[1];
}

static void set_black(struct pss_state *state)
{
	state->sample.splat_count = 0;
	state->sample.class_mask = 0;
	state->sample.intensity = state->weight = 0;
}

static bool start(struct chain *base, uint64_t bootstrap_index)
{
	struct pss_chain *c = pss_chain_of(base);
	set_states(c);
	struct pss_sampler s;
	pss_sampler_init(&s, &c->current->point, NULL, base->seed, RNG_BOOTSTRAP, bootstrap_index, 0);
	if (bootstrap_index == UINT64_MAX) {
		set_black(c->current);
		return true;
	}
	evaluate(c, &s, c->current);
	return c->current->sample.intensity > 0;
}

/* Evaluates a complete point: the sampler of a large step finds all blocks already filled. */
static void reevaluate(struct pss_chain *c)
{
	struct pss_point copy = c->current->point;
	struct pss_sampler s;
	pss_sampler_init(&s, &c->current->point, NULL, c->base.seed, RNG_CHAIN, c->base.id, c->base.step);
	c->current->point = copy;
	evaluate(c, &s, c->current);
}

static int save(struct chain *base, struct chain_state *out)
{
	const struct pss_chain *c = pss_chain_of(base);
	uint8_t bytes[CHAIN_STATE_HEADER_BYTES + 8 + sizeof c->current->point.u];
	_Static_assert(sizeof bytes <= CHAIN_STATE_MAX, "a coordinator would refuse it");
	chain_write_header(base, bytes);
	size_t n = pss_write(&c->current->point, bytes + CHAIN_STATE_HEADER_BYTES,
			     sizeof bytes - CHAIN_STATE_HEADER_BYTES);
	assert(n > 0);
	return chain_state_copy_bytes(bytes, CHAIN_STATE_HEADER_BYTES + n, out);
}

static bool resume(struct chain *base, const struct chain_state *state)
{
	struct pss_chain *c = pss_chain_of(base);
	set_states(c);
	if (!chain_read_header(base, state->bytes, state->size))
		return false;
	unsigned flags = fptrap_enter_library(); /* the bytes are not trusted: a signalling NaN is refused and is not a
						    fault of ours */
	size_t n = pss_read(&c->current->point, state->bytes + CHAIN_STATE_HEADER_BYTES,
			    state->size - CHAIN_STATE_HEADER_BYTES);
	fptrap_leave_library(flags);
	if (n == 0 || n != state->size - CHAIN_STATE_HEADER_BYTES)
		return false;
	if (c->current->point.block_count[SIDE_CAMERA] == 0) {
		set_black(c->current);
		return true;
	}
	reevaluate(c);
	return c->current->sample.intensity > 0;
}

static void splat_state(struct pss_chain *c, struct pss_state *state)
{
	if (state->weight == 0)
		return;
	/* Splats are divided by the intensity, not multiplied by its reciprocal, which is infinite
	 * for a denormal intensity. */
	double intensity = state->sample.intensity;
	for (uint32_t i = 0; i < state->sample.splat_count; i++) {
		struct splat s = state->sample.splats[i];
		for (int k = 0; k < 3; k++)
			s.xyz[k] /= intensity;
		film_sums_splat(c->base.film, &s, state->weight);
	}
	struct chain_moments *m = &c->base.film->moments;
	chain_moments_add_state(m, state->sample.splats, state->sample.splat_count, intensity, state->weight);
	for (uint32_t remaining = state->sample.class_mask; remaining; remaining &= remaining - 1) {
		unsigned k = (unsigned)__builtin_ctz(remaining);
		chain_moments_add_class(m, k, state->sample.class_intensity[k] / intensity * state->weight);
	}
	state->weight = 0;
}

static void flush(struct chain *base)
{
	splat_state(pss_chain_of(base), pss_chain_of(base)->current);
}

static void step(struct chain *base, struct chain_sums *sums)
{
	struct pss_chain *c = pss_chain_of(base);
	uint64_t *counters = base->context->counters;
	double choice[SAMPLER_BLOCK_SIZE], current_intensity = c->current->sample.intensity;
	base->step++;
	pss_draw_choices(base->seed, base->id, base->step, choice);
	bool large = !(current_intensity > 0) || choice[PSS_CHOOSE_LARGE] < LARGE_STEP_PROBABILITY;
	struct pss_sampler s;
	pss_sampler_init(&s, &c->proposal->point, large ? NULL : &c->current->point, base->seed, RNG_CHAIN, base->id,
			 base->step);
	evaluate(c, &s, c->proposal);
	double proposal_intensity = c->proposal->sample.intensity;
	counters[COUNT_SAMPLES]++;
	if (large) {
		counters[COUNT_INDEPENDENT]++;
		sums->sum += proposal_intensity;
		sums->square_sum += proposal_intensity * proposal_intensity;
	}
	double acceptance =
		proposal_intensity > 0
			? (proposal_intensity < current_intensity ? proposal_intensity / current_intensity : 1)
			: 0;
	if (current_intensity > 0)
		c->current->weight += 1 - acceptance;
	c->proposal->weight = acceptance;
	bool accepted = choice[PSS_ACCEPT] < acceptance;
	chain_count_decision(base, accepted);
	if (!accepted) {
		splat_state(c, c->proposal);
		return;
	}
	splat_state(c, c->current);
	struct pss_state *swap = c->current;
	c->current = c->proposal;
	c->proposal = swap;
}

static const struct chain_ops chain_ops_pss = {
	.size = sizeof(struct pss_chain),
	.start = start,
	.resume = resume,
	.step = step,
	.flush = flush,
	.save = save,
};

const struct integrator integrator_pssmlt = {
	.properties = {.name = "pssmlt", .kind = PLAN_CHAINS, .max_depth = PSS_EDGES_MAX},
	.stream = RNG_BOOTSTRAP,
	.evaluate = path_trace_bidirectional,
	.chain = &chain_ops_pss,
};
