/* SPDX-License-Identifier: Apache-2.0 */
/*
 * batch_check protects the canvas from the network: a batch that passes can be merged without further checks. One
 * function checks each kind of content against the plan: the lease, the tiles (inside the crop, aligned, in order, all
 * values finite), the number and sizes of chain states, the bootstrap weights, the counters and sums (which must be
 * consistent with each other), the path classes, the moments and the counters of strategies.
 *
 * Failures are -EBADMSG with a sentence for the log. A batch that fails is refused as a whole.
 */
#include "common/film/batch.h"

#include "common/base/mem.h"

#include <float.h>
#include <math.h>
#include <string.h>

const char *lease_kind_name(enum lease_kind kind)
{
	return kind == LEASE_BOOTSTRAP ? "bootstrap" : "render";
}

bool lease_key_equal(const struct lease_key *a, const struct lease_key *b)
{
	return a->job == b->job && a->kind == b->kind && a->group == b->group && a->part == b->part &&
	       a->epoch == b->epoch;
}

void batch_fini(struct batch *b)
{
	for (uint32_t i = 0; b->tiles && i < b->tile_count; i++)
		mem_free(b->tiles[i].xyz);
	for (uint32_t i = 0; b->states && i < b->state_count; i++)
		mem_free(b->states[i].bytes);
	mem_free(b->tiles);
	mem_free(b->states);
	mem_free(b->weights);
	mem_free(b->moments);
	*b = (struct batch){0};
}

uint32_t batch_film_tile_count(const struct plan *p)
{
	return ((p->crop_width + TILE_SIZE - 1) / TILE_SIZE) * ((p->crop_height + TILE_SIZE - 1) / TILE_SIZE);
}

uint32_t batch_sequence_count(const struct plan *p)
{
	if (p->kind != PLAN_CHAINS)
		return 0;
	return p->chains > SEQUENCES_MAX ? 1 : p->chains / (p->groups * p->parts);
}

uint64_t batch_moment_count(const struct plan *p, enum lease_kind kind)
{
	uint64_t sequences = kind == LEASE_RENDER ? batch_sequence_count(p) : 0;
	return sequences ? (sequences + 1) * batch_film_tile_count(p) : 0;
}

static int check_key(const struct lease_key *k, const struct plan *p, struct error *e)
{
	if (k->kind != LEASE_BOOTSTRAP && k->kind != LEASE_RENDER)
		return error_set(e, EBADMSG, "unknown kind of lease %d", (int)k->kind);
	if (k->group >= p->groups || k->part >= p->parts)
		return error_set(e, EBADMSG, "no group %u with a part %u in this plan", k->group, k->part);
	uint64_t epochs = k->kind == LEASE_BOOTSTRAP ? 1 : p->rounds;
	if (k->epoch >= epochs)
		return error_set(e, EBADMSG, "epoch %llu of %llu", (unsigned long long)k->epoch,
				 (unsigned long long)epochs);
	return 0;
}

static bool are_finite(const float *v, size_t n)
{
	/* An exponent of all ones means infinity or NaN. The loop has no branch, so that it can be vectorised. */
	uint32_t bad = 0;
	for (size_t i = 0; i < n; i++) {
		uint32_t bits;
		memcpy(&bits, v + i, sizeof bits);
		bad |= (uint32_t)((bits & 0x7f800000u) == 0x7f800000u);
	}
	return !bad;
}

static int check_tiles(const struct batch *b, const struct plan *p, struct error *e)
{
	uint32_t across = (p->crop_width + TILE_SIZE - 1) / TILE_SIZE;
	int64_t last = -1;
	if (b->tile_count && b->key.kind == LEASE_BOOTSTRAP)
		return error_set(e, EBADMSG, "a bootstrap batch with tiles");
	for (uint32_t i = 0; i < b->tile_count; i++) {
		const struct tile *t = &b->tiles[i];
		if (t->x < p->crop_x || t->y < p->crop_y || t->x - p->crop_x >= p->crop_width ||
		    t->y - p->crop_y >= p->crop_height)
			return error_set(e, EBADMSG, "a tile at %u,%u outside the crop", t->x, t->y);
		uint32_t x = t->x - p->crop_x, y = t->y - p->crop_y;
		uint32_t w = p->crop_width - x < TILE_SIZE ? p->crop_width - x : TILE_SIZE;
		uint32_t h = p->crop_height - y < TILE_SIZE ? p->crop_height - y : TILE_SIZE;
		if (x % TILE_SIZE || y % TILE_SIZE || t->width != w || t->height != h || !t->xyz)
			return error_set(e, EBADMSG, "a tile of %ux%u at %u,%u is not one of the film's", t->width,
					 t->height, t->x, t->y);
		int64_t index = (int64_t)(y / TILE_SIZE) * across + x / TILE_SIZE;
		if (index <= last)
			return error_set(e, EBADMSG, "the tile at %u,%u is repeated or out of order", t->x, t->y);
		last = index;
		if (!are_finite(t->xyz, (size_t)w * h * TILE_CHANNELS))
			return error_set(e, EBADMSG, "the tile at %u,%u holds a value that is not finite", t->x, t->y);
	}
	return 0;
}

enum {
	STATE_HEAD_MAX = 64, /* most bytes of a state besides its vertices */
	/* Most bytes per vertex: random numbers of both sub-paths; a stored path needs only 40. */
	STATE_VERTEX_MAX = 128,
	STATE_OVERHEAD = 48, /* memory per state besides its bytes: struct chain_state and the allocator's overhead */
};

uint32_t chain_state_max_bytes(const struct plan *p)
{
	uint64_t vertices = (uint64_t)p->max_depth + 1, size = STATE_HEAD_MAX + STATE_VERTEX_MAX * vertices;
	return size < CHAIN_STATE_MAX ? (uint32_t)size : CHAIN_STATE_MAX;
}

uint64_t chain_states_max_bytes(const struct plan *p)
{
	return (uint64_t)p->chains * (chain_state_max_bytes(p) + STATE_OVERHEAD);
}

uint64_t chain_states_bytes(const struct chain_state *s, uint32_t count)
{
	uint64_t sum = 0;
	for (uint32_t i = 0; s && i < count; i++)
		sum += s[i].size + STATE_OVERHEAD;
	return sum;
}

/* *live_count: the number of chains that run, whose states are not empty. */
static int check_states(const struct batch *b, const struct plan *p, uint64_t *live_count, struct error *e)
{
	struct plan_range chains = plan_chain_range(p, b->key.part);
	bool has_states = p->kind == PLAN_CHAINS && b->key.kind == LEASE_RENDER;
	uint64_t expected = has_states ? chains.end - chains.begin : 0;
	*live_count = 0;
	if (b->state_count != expected)
		return error_set(e, EBADMSG, "%u chain states where there should be %llu", b->state_count,
				 (unsigned long long)expected);
	for (uint32_t i = 0; i < b->state_count; i++) {
		const struct chain_state *s = &b->states[i];
		if (s->size > chain_state_max_bytes(p) || (s->size && !s->bytes))
			return error_set(e, EBADMSG,
					 "a chain state of %u bytes; paths of up to %u edges have at most %u", s->size,
					 p->max_depth, chain_state_max_bytes(p));
		*live_count += s->size > 0;
	}
	return 0;
}

static int check_weights(const struct batch *b, const struct plan *p, struct error *e)
{
	struct plan_range r = plan_bootstrap_range(p, b->key.group, b->key.part);
	uint64_t expected = b->key.kind == LEASE_BOOTSTRAP ? r.end - r.begin : 0;
	if (b->weight_count != expected || (expected && !b->weights))
		return error_set(e, EBADMSG, "%llu bootstrap weights where there should be %llu",
				 (unsigned long long)b->weight_count, (unsigned long long)expected);
	for (uint64_t i = 0; i < b->weight_count; i++)
		if (!(b->weights[i] >= 0) || !isfinite(b->weights[i]))
			return error_set(e, EBADMSG, "a bootstrap weight is negative or not finite");
	return 0;
}

/* Relative tolerance between sums of the same terms in different orders, partly rounded to float. */
#define ROUNDING_FACTOR (1 + 1e-6)

/* Above anything that one sample can add to a counter, such as the rays of a path of 128 edges with all its connections
 * and of the chains that it starts. */
#define PER_SAMPLE_MAX 0x1p24

static int check_counter_range(const struct batch *b, const struct plan *p, uint64_t samples, struct error *e)
{
	const uint64_t *c = b->counters;
	bool chains = p->kind == PLAN_CHAINS && b->key.kind == LEASE_RENDER;
	for (int i = 0; i < BATCH_COUNTERS; i++)
		if (c[i] >> 56 ||
		    (i != COUNT_LONGEST_STUCK && !((double)c[i] <= ((double)samples + 1) * PER_SAMPLE_MAX)))
			return error_set(e, EBADMSG, "counter %d is %llu, more than a lease can count", i,
					 (unsigned long long)c[i]);
	uint64_t max_rejections = chains ? (b->key.epoch + 1) * p->epoch : 0;
	if (c[COUNT_LONGEST_STUCK] > max_rejections)
		return error_set(e, EBADMSG, "%llu rejections in a row after %llu mutations of a chain",
				 (unsigned long long)c[COUNT_LONGEST_STUCK], (unsigned long long)max_rejections);
	return 0;
}

/* Checks that the sum and the sum of squares of n non-negative terms are possible: each term is in the range of float,
 * and sum^2 / n <= squares <= sum^2 (the first is the Cauchy-Schwarz inequality). Squares may have underflowed. */
static int check_sums(const struct batch *b, struct error *e)
{
	const double sums[] = {b->independent_sum, b->independent_square, b->overlong_sum, b->cpu_seconds};
	for (int i = 0; i < 4; i++)
		if (!isfinite(sums[i]) || sums[i] < 0)
			return error_set(e, EBADMSG, "a sum over independent samples is negative or not finite");
	double n = (double)b->counters[COUNT_INDEPENDENT], sum = b->independent_sum, square = b->independent_square;
	if (!(sum <= n * (double)FLT_MAX * ROUNDING_FACTOR))
		return error_set(e, EBADMSG, "%g independent samples add up to %g", n, sum);
	if (!(sum * sum <= n * (square * ROUNDING_FACTOR + DBL_MIN)) ||
	    !(square <= sum * sum * ROUNDING_FACTOR + n * DBL_MIN))
		return error_set(e, EBADMSG, "%g independent samples add up to %g and their squares to %g", n, sum,
				 square);
	if (b->key.kind != LEASE_BOOTSTRAP)
		return 0;
	double weights = 0;
	for (uint64_t i = 0; i < b->weight_count; i++)
		weights += (double)b->weights[i];
	if (!(fabs(weights - sum) <= (ROUNDING_FACTOR - 1) * sum + n * (double)FLT_MIN))
		return error_set(e, EBADMSG, "bootstrap weights that add up to %g where their sum is %g", weights, sum);
	return 0;
}

static int check_counts(const struct batch *b, const struct plan *p, uint64_t live_count, struct error *e)
{
	const uint64_t *c = b->counters;
	struct plan_range rows = plan_row_range(p, b->key.part);
	uint64_t samples;
	if (b->key.kind == LEASE_BOOTSTRAP)
		samples = b->weight_count;
	else if (p->kind == PLAN_CHAINS)
		samples = live_count * p->epoch;
	else
		samples = (rows.end - rows.begin) * (p->crop_width + 2 * (uint64_t)p->border) * p->epoch;
	if (b->key.kind == LEASE_BOOTSTRAP ? c[COUNT_INDEPENDENT] != samples : c[COUNT_SAMPLES] != samples)
		return error_set(
			e, EBADMSG, "%llu samples where the plan has %llu",
			(unsigned long long)c[b->key.kind == LEASE_BOOTSTRAP ? COUNT_INDEPENDENT : COUNT_SAMPLES],
			(unsigned long long)samples);
	if (c[COUNT_SAMPLES] > samples || c[COUNT_INDEPENDENT] > samples || c[COUNT_ACCEPTED] > samples ||
	    c[COUNT_STUCK] > b->state_count || c[COUNT_STATES_LOST] > b->state_count)
		return error_set(e, EBADMSG, "more accepted, independent, stuck or lost chains than there are");
	int rc = check_counter_range(b, p, samples, e);
	return rc ? rc : check_sums(b, e);
}

static int check_strategies(const struct batch *b, const struct plan *p, struct error *e)
{
	uint64_t proposed = 0, accepted = 0;
	bool has_strategies = b->key.kind == LEASE_RENDER;
	int expected = has_strategies ? plan_strategy_count(p->mutations) : 0;
	if (b->strategy_count != 0 && (int64_t)b->strategy_count != expected)
		return error_set(e, EBADMSG, "counters of %u strategies where the plan has %d", b->strategy_count,
				 expected);
	for (uint32_t i = 0; i < b->strategy_count; i++) {
		const uint64_t *c = b->strategies[i];
		for (int k = 0; k < STRATEGY_COUNTERS; k++)
			if (c[k] >> 56 ||
			    ((k == STRATEGY_ACCEPTED || k >= STRATEGY_FAIL_FIRST) && c[k] > c[STRATEGY_PROPOSED]))
				return error_set(e, EBADMSG, "counter %d of strategy %u is %llu of %llu proposals", k,
						 i, (unsigned long long)c[k], (unsigned long long)c[STRATEGY_PROPOSED]);
		uint64_t ended = c[STRATEGY_ACCEPTED];
		for (int k = STRATEGY_FAIL_FIRST; k < STRATEGY_COUNTERS; k++)
			ended += c[k];
		if (ended > c[STRATEGY_PROPOSED])
			return error_set(e, EBADMSG, "%llu proposals of strategy %u were accepted or failed, of %llu",
					 (unsigned long long)ended, i, (unsigned long long)c[STRATEGY_PROPOSED]);
		proposed += c[STRATEGY_PROPOSED];
		accepted += c[STRATEGY_ACCEPTED];
	}
	if (accepted > b->counters[COUNT_ACCEPTED])
		return error_set(e, EBADMSG, "%llu accepted proposals in %llu accepted mutations",
				 (unsigned long long)accepted, (unsigned long long)b->counters[COUNT_ACCEPTED]);
	if (proposed > b->counters[COUNT_SAMPLES])
		return error_set(e, EBADMSG, "%llu proposals in %llu mutations", (unsigned long long)proposed,
				 (unsigned long long)b->counters[COUNT_SAMPLES]);
	return 0;
}

static int check_classes(const struct batch *b, const struct plan *p, struct error *e)
{
	bool is_time = p->kind == PLAN_CHAINS && b->key.kind == LEASE_RENDER;
	double sum = 0, max_sum = is_time ? (double)b->counters[COUNT_SAMPLES] : b->independent_sum;
	for (int i = 0; i < PATH_CLASSES; i++) {
		if (!(b->classes[i] >= 0) || !isfinite(b->classes[i]))
			return error_set(e, EBADMSG, "the sum of a path class is negative or not finite");
		sum += b->classes[i];
	}
	if (!(sum <= max_sum * ROUNDING_FACTOR))
		return error_set(e, EBADMSG, "the path classes add up to %g, more than %g", sum, max_sum);
	return 0;
}

static int check_moments(const struct batch *b, const struct plan *p, struct error *e)
{
	uint64_t expected = batch_moment_count(p, b->key.kind), tiles = batch_film_tile_count(p),
		 sequences = batch_sequence_count(p);
	if (b->moment_count != expected || (expected && !b->moments))
		return error_set(e, EBADMSG, "%llu moments where there should be %llu",
				 (unsigned long long)b->moment_count, (unsigned long long)expected);
	if (expected == 0)
		return 0;
	for (uint64_t i = 0; i < expected; i++)
		if (!(b->moments[i] >= 0) || !isfinite(b->moments[i]))
			return error_set(e, EBADMSG, "a moment is negative or not finite");
	double max_sum = (double)b->state_count / (double)sequences * (double)p->epoch * ROUNDING_FACTOR;
	for (uint64_t s = 0; s < sequences; s++) {
		double sum = 0;
		for (uint64_t t = 0; t < tiles; t++)
			sum += (double)b->moments[s * tiles + t];
		if (!(sum <= max_sum))
			return error_set(e, EBADMSG, "a chain was in tiles %g times in %g mutations", sum, max_sum);
	}
	for (uint64_t t = 0; t < tiles; t++) {
		double first = 0;
		for (uint64_t s = 0; s < sequences; s++)
			first += (double)b->moments[s * tiles + t];
		/* Proposals with a tiny acceptance probability leave moments below FLT_MIN, where floats lose bits. */
		double lost = ((double)sequences + 1) * (double)FLT_TRUE_MIN;
		if (!((double)b->moments[sequences * tiles + t] <= first * ROUNDING_FACTOR + lost))
			return error_set(e, EBADMSG, "a second moment above the first");
	}
	return 0;
}

int batch_check(const struct batch *b, const struct plan *p, struct error *e)
{
	uint64_t live_count;
	int rc = check_key(&b->key, p, e);
	if (rc == 0)
		rc = check_tiles(b, p, e);
	if (rc == 0)
		rc = check_states(b, p, &live_count, e);
	if (rc == 0)
		rc = check_weights(b, p, e);
	if (rc == 0)
		rc = check_counts(b, p, live_count, e);
	if (rc == 0)
		rc = check_classes(b, p, e);
	if (rc == 0)
		rc = check_moments(b, p, e);
	return rc ? rc : check_strategies(b, p, e);
}
