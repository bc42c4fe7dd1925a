#include "worker/chain/chain.h"

#include "common/base/mem.h"

#include <assert.h>
#include <string.h>

static void evaluate(struct chain *c, struct pss_sampler *s, struct chain_place *at)
{
	c->integrator->evaluate(c->context, &s->base, &at->sample);
	at->weight = 0;
}

static void set_places(struct chain *c)
{
	c->current = &c->place[0];
	c->proposal = &c->place[1];
}

bool chain_start(struct chain *c, uint64_t bootstrap_index)
{
	set_places(c);
	c->step = c->rejected_run = 0;
	struct pss_sampler s;
	pss_sampler_init(&s, &c->current->point, NULL, c->seed, RNG_BOOTSTRAP, bootstrap_index, 0);
	if (bootstrap_index == UINT64_MAX) {
		c->current->sample.count = 0;
		c->current->sample.intensity = c->current->weight = 0;
		return true;
	}
	evaluate(c, &s, c->current);
	return c->current->sample.intensity > 0;
}

/* Evaluates a point that is all there: a large step's sampler that finds every block in place. */
static void revisit(struct chain *c)
{
	struct pss_point copy = c->current->point;
	struct pss_sampler s;
	pss_sampler_init(&s, &c->current->point, NULL, c->seed, RNG_CHAIN, c->id, c->step);
	c->current->point = copy;
	evaluate(c, &s, c->current);
}

enum { STATE_HEADER = 24 };

static void put64(uint8_t *p, uint64_t v)
{
	for (int i = 0; i < 8; i++)
		p[i] = (uint8_t)(v >> (8 * i));
}

static uint64_t get64(const uint8_t *p)
{
	uint64_t v = 0;
	for (int i = 0; i < 8; i++)
		v |= (uint64_t)p[i] << (8 * i);
	return v;
}

int chain_save(const struct chain *c, struct chain_state *out)
{
	uint8_t bytes[STATE_HEADER + 8 + sizeof c->current->point.u];
	put64(bytes, c->id);
	put64(bytes + 8, c->step);
	put64(bytes + 16, c->rejected_run);
	size_t n = pss_write(&c->current->point, bytes + STATE_HEADER, sizeof bytes - STATE_HEADER);
	assert(n > 0);
	out->size = (uint32_t)(STATE_HEADER + n);
	out->bytes = mem_alloc(out->size, 1);
	if (!out->bytes)
		return -ENOMEM;
	memcpy(out->bytes, bytes, out->size);
	return 0;
}

bool chain_resume(struct chain *c, const struct chain_state *state)
{
	set_places(c);
	if (state->size < STATE_HEADER || get64(state->bytes) != c->id)
		return false;
	c->step = get64(state->bytes + 8);
	c->rejected_run = get64(state->bytes + 16);
	size_t n = pss_read(&c->current->point, state->bytes + STATE_HEADER, state->size - STATE_HEADER);
	if (n == 0 || n != state->size - STATE_HEADER)
		return false;
	if (c->current->point.used[SIDE_CAMERA] == 0) {
		c->current->sample.count = 0;
		c->current->sample.intensity = c->current->weight = 0;
		return true;
	}
	revisit(c);
	return c->current->sample.intensity > 0;
}

static void splat(struct chain *c, struct chain_place *at)
{
	if (at->weight == 0)
		return;
	for (uint32_t i = 0; i < at->sample.count; i++)
		film_sums_splat(c->film, &at->sample.splats[i], at->weight / at->sample.intensity);
	at->weight = 0;
}

void chain_flush(struct chain *c)
{
	splat(c, c->current);
}

void chain_step(struct chain *c, struct chain_sums *sums)
{
	uint64_t *counters = c->context->counters;
	double choice[SAMPLER_BLOCK], here = c->current->sample.intensity;
	c->step++;
	pss_choices(c->seed, c->id, c->step, choice);
	bool large = !(here > 0) || choice[PSS_CHOOSE_LARGE] < CHAIN_LARGE_STEP;
	struct pss_sampler s;
	pss_sampler_init(&s, &c->proposal->point, large ? NULL : &c->current->point, c->seed, RNG_CHAIN, c->id, c->step);
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
	if (choice[PSS_ACCEPT] < a) {
		splat(c, c->current);
		struct chain_place *swap = c->current;
		c->current = c->proposal;
		c->proposal = swap;
		counters[COUNT_ACCEPTED]++;
		c->rejected_run = 0;
		return;
	}
	splat(c, c->proposal);
	c->rejected_run++;
	if (c->rejected_run > counters[COUNT_LONGEST_STUCK])
		counters[COUNT_LONGEST_STUCK] = c->rejected_run;
}
