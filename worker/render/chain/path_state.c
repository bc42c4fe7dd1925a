/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/chain/path_state.h"

#include "worker/render/path/ensemble.h"
#include "worker/render/path/integrate_bdpt.h"

#include <float.h>

#define LOG_FLT_MAX (FLT_MAX_EXP * M_LN2)

void path_state_copy(struct full_path *to, const struct full_path *from)
{
	if (from->edges)
		full_path_copy(to, from, 0, from->edges);
	to->edges = from->edges;
}

void path_state_sync_proposal(struct full_path *proposal, const struct full_path *current,
			      const struct proposal_move *move, bool any_may_differ)
{
	if (any_may_differ || proposal->edges != current->edges)
		path_state_copy(proposal, current);
	else
		full_path_copy(proposal, current, move->first, move->last);
}

bool path_state_weight_is_valid(const struct path_context *c, double log_weight, bool bounded)
{
	if (isnan(log_weight))
		c->counters[COUNT_NAN]++;
	else if (log_weight == INFINITY || (bounded && log_weight > LOG_FLT_MAX))
		c->counters[COUNT_INFINITE]++;
	else
		return true;
	return false;
}

void path_evaluate_bootstrap(struct path_context *c, struct sampler *s, struct path_sample *out)
{
	const double max_survival = c->max_survival;
	c->max_survival = PATH_SURVIVAL_MAX;
	c->makes_faint_connections = true;
	path_trace_candidates(c, s, out);
	c->makes_faint_connections = false;
	c->max_survival = max_survival;
}

bool path_choose_seed(struct path_context *c, uint64_t seed, uint64_t bootstrap_index, struct full_path *x)
{
	struct sampler_random s;
	double choice[SAMPLER_BLOCK_SIZE];
	struct ensemble candidates;
	const struct ensemble_lengths lengths = ensemble_max_lengths(c);
	sampler_random_init(&s, seed, RNG_BOOTSTRAP, bootstrap_index, 0);
	sampler_fill_block(seed, RNG_BOOTSTRAP, bootstrap_index, 0, SIDE_CAMERA, PATH_EDGES_MAX + 2, choice);
	const double max_survival = c->max_survival;
	c->max_survival = PATH_SURVIVAL_MAX;
	ensemble_draw(c, &s.base, &lengths, &candidates);
	c->max_survival = max_survival;
	if (candidates.count == 0)
		return false;
	/* At the very border of the sampled region, the path may lie outside when it is computed again: once in
	 * millions of cases. The chain then looks for light like one without a seed. */
	if (!ensemble_choose(c, &candidates, choice[0], x))
		x->edges = 0;
	return true;
}
