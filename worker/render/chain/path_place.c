/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/chain/path_place.h"

#include "worker/render/path/ensemble.h"
#include "worker/render/path/integrate_bdpt.h"

#include <float.h>

#define LOG_FLT_MAX (FLT_MAX_EXP * M_LN2)

void path_place_copy(struct full_path *to, const struct full_path *from)
{
	if (from->edges)
		full_path_copy(to, from, 0, from->edges);
	to->edges = from->edges;
}

void path_place_follow(struct full_path *proposal, const struct full_path *current, const struct move *move, bool all)
{
	if (all || proposal->edges != current->edges)
		path_place_copy(proposal, current);
	else
		full_path_copy(proposal, current, move->first, move->last);
}

bool path_place_is_sound(const struct path_context *c, double log_weight, bool bounded)
{
	if (isnan(log_weight))
		c->counters[COUNT_NAN]++;
	else if (log_weight == INFINITY || (bounded && log_weight > LOG_FLT_MAX))
		c->counters[COUNT_INFINITE]++;
	else
		return true;
	return false;
}

void path_bootstrap(struct path_context *c, struct sampler *s, struct path_sample *out)
{
	const double roulette = c->roulette;
	c->roulette = PATH_ROULETTE;
	c->makes_all = true;
	path_trace_candidates(c, s, out);
	c->makes_all = false;
	c->roulette = roulette;
}

bool path_start(struct path_context *c, uint64_t seed, uint64_t bootstrap_index, struct full_path *x)
{
	struct sampler_random s;
	double choice[SAMPLER_BLOCK];
	struct ensemble candidates;
	const struct ensemble_lengths all = ensemble_all_lengths(c);
	sampler_random_init(&s, seed, RNG_BOOTSTRAP, bootstrap_index, 0);
	sampler_fill(seed, RNG_BOOTSTRAP, bootstrap_index, 0, SIDE_CAMERA, PATH_MAX_EDGES + 2, choice);
	const double roulette = c->roulette;
	c->roulette = PATH_ROULETTE;
	ensemble_draw(c, &s.base, &all, &candidates);
	c->roulette = roulette;
	if (candidates.count == 0)
		return false;
	/* At the very border of the sampled region, the path may lie outside when it is computed again: once in
	 * millions of cases. The chain then looks for light like one without a seed. */
	if (!ensemble_choose(c, &candidates, choice[0], x))
		x->edges = 0;
	return true;
}
