/* SPDX-License-Identifier: Apache-2.0 */
/* Primary sample space Metropolis light transport (Kelemen et al. 2002), over the bidirectional path tracer. */
#include "worker/render/chain/chain.h"
#include "worker/render/chain/pss.h"
#include "worker/render/math/fptrap.h"
#include "worker/render/path/integrate_bdpt.h"
#include "worker/render/path/integrator.h"

#include <assert.h>

/* The fraction of independent proposals. */
#define LARGE_STEP 0.3

struct pss_place {
	struct pss_point point;
	struct path_sample sample;
	double weight; /* accumulated but not yet splatted */
};

struct pss_chain {
	struct chain base;
	struct pss_place place[2];
	struct pss_place *current, *proposal;
};

static struct pss_chain *pss_of(struct chain *c)
{
	return (struct pss_chain *)(void *)c;
}

static void evaluate(struct pss_chain *c, struct pss_sampler *s, struct pss_place *at)
{
	c->base.integrator->evaluate(c->base.context, &s->base, &at->sample);
	at->weight = 0;
}

static void set_places(struct pss_chain *c)
{
	c->current = &c->place[0];
	c->proposal = &c->place[1];
}

static void set_black(struct pss_place *at)
{
	at->sample.count = 0;
	at->sample.classes = 0;
	at->sample.intensity = at->weight = 0;
}

static bool start(struct chain *base, uint64_t bootstrap_index)
{
	struct pss_chain *c = pss_of(base);
	set_places(c);
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
	const struct pss_chain *c = pss_of(base);
	uint8_t bytes[CHAIN_STATE_HEAD + 8 + sizeof c->current->point.u];
	_Static_assert(sizeof bytes <= CHAIN_STATE_MAX, "a coordinator would refuse it");
	chain_put_head(base, bytes);
	size_t n = pss_write(&c->current->point, bytes + CHAIN_STATE_HEAD, sizeof bytes - CHAIN_STATE_HEAD);
	assert(n > 0);
	return chain_give(bytes, CHAIN_STATE_HEAD + n, out);
}

static bool resume(struct chain *base, const struct chain_state *state)
{
	struct pss_chain *c = pss_of(base);
	set_places(c);
	if (!chain_get_head(base, state->bytes, state->size))
		return false;
	unsigned flags =
		fptrap_leave(); /* the bytes are not trusted: a signalling NaN is refused and is not a fault of ours */
	size_t n = pss_read(&c->current->point, state->bytes + CHAIN_STATE_HEAD, state->size - CHAIN_STATE_HEAD);
	fptrap_return(flags);
	if (n == 0 || n != state->size - CHAIN_STATE_HEAD)
		return false;
	if (c->current->point.used[SIDE_CAMERA] == 0) {
		set_black(c->current);
		return true;
	}
	reevaluate(c);
	return c->current->sample.intensity > 0;
}

static void splat(struct pss_chain *c, struct pss_place *at)
{
	if (at->weight == 0)
		return;
	/* Splats are divided by the intensity, not multiplied by its reciprocal, which is infinite
	 * for a denormal intensity. */
	double intensity = at->sample.intensity;
	for (uint32_t i = 0; i < at->sample.count; i++) {
		struct splat s = at->sample.splats[i];
		for (int k = 0; k < 3; k++)
			s.xyz[k] /= intensity;
		film_sums_splat(c->base.film, &s, at->weight);
	}
	struct chain_moments *m = &c->base.film->moments;
	chain_moments_state(m, at->sample.splats, at->sample.count, intensity, at->weight);
	for (uint32_t rest = at->sample.classes; rest; rest &= rest - 1) {
		unsigned k = (unsigned)__builtin_ctz(rest);
		chain_moments_class(m, k, at->sample.of_class[k] / intensity * at->weight);
	}
	at->weight = 0;
}

static void flush(struct chain *base)
{
	splat(pss_of(base), pss_of(base)->current);
}

static void step(struct chain *base, struct chain_sums *sums)
{
	struct pss_chain *c = pss_of(base);
	uint64_t *counters = base->context->counters;
	double choice[SAMPLER_BLOCK], here = c->current->sample.intensity;
	base->step++;
	pss_choices(base->seed, base->id, base->step, choice);
	bool large = !(here > 0) || choice[PSS_CHOOSE_LARGE] < LARGE_STEP;
	struct pss_sampler s;
	pss_sampler_init(&s, &c->proposal->point, large ? NULL : &c->current->point, base->seed, RNG_CHAIN, base->id,
			 base->step);
	evaluate(c, &s, c->proposal);
	double there = c->proposal->sample.intensity;
	counters[COUNT_SAMPLES]++;
	if (large) {
		counters[COUNT_INDEPENDENT]++;
		sums->sum += there;
		sums->square += there * there;
	}
	double a = there > 0 ? (there < here ? there / here : 1) : 0;
	if (here > 0)
		c->current->weight += 1 - a;
	c->proposal->weight = a;
	bool accepted = choice[PSS_ACCEPT] < a;
	chain_count(base, accepted);
	if (!accepted) {
		splat(c, c->proposal);
		return;
	}
	splat(c, c->current);
	struct pss_place *swap = c->current;
	c->current = c->proposal;
	c->proposal = swap;
}

static const struct chain_ops chain_pss = {
	.size = sizeof(struct pss_chain),
	.start = start,
	.resume = resume,
	.step = step,
	.flush = flush,
	.save = save,
};

const struct integrator integrator_pssmlt = {
	.face = {.name = "pssmlt", .kind = PLAN_CHAINS, .max_depth = PSS_MAX_EDGES},
	.stream = RNG_BOOTSTRAP,
	.evaluate = path_trace_both_ways,
	.chain = &chain_pss,
};
