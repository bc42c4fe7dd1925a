/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/chain/path_start.h"

#include "worker/render/path/ensemble.h"

bool path_start(struct path_context *c, uint64_t seed, uint64_t bootstrap_index, struct full_path *x)
{
	struct sampler_random s;
	double choice[SAMPLER_BLOCK];
	struct ensemble candidates;
	const struct ensemble_lengths all = ensemble_all_lengths(c);
	sampler_random_init(&s, seed, RNG_BOOTSTRAP, bootstrap_index, 0);
	sampler_fill(seed, RNG_BOOTSTRAP, bootstrap_index, 0, SIDE_CAMERA, PATH_MAX_EDGES + 2, choice);
	ensemble_draw(c, &s.base, &all, &candidates);
	if (candidates.count == 0)
		return false;
	/* On the very border of what is sampled the path that was drawn may lie outside when it is computed again: once
	 * in millions. The chain then looks for light as one without a seed does. */
	if (!ensemble_choose(c, &candidates, choice[0], x))
		x->edges = 0;
	return true;
}
