/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Independent proposals from all techniques at once: a pair of sub-paths is drawn, then one of the paths that it forms,
 * in proportion to its contribution weighted by the balance heuristic. The weight of the current state is the sum over
 * a pair of sub-paths around it, drawn as if the state had been drawn from that pair. On the space of pairs with a
 * marked candidate this is an independence sampler whose target is the pair's density times the candidate's
 * contribution. So chains change length and class, and the sums estimate b with the variance of bdpt.
 */
#include "worker/render/mutation/mutation.h"
#include "worker/render/path/ensemble.h"
#include "worker/render/world/effects_text.h"

#include <math.h>

enum { BLOCK_LENGTHS = BLOCK_VERTEX, BLOCK_AROUND };

static enum proposal_result propose(const struct mutation_ops *self, struct mutation_ctx *m,
				    const struct mutation_forced_choice *forced, struct full_path *x,
				    struct full_path *y, struct proposal_move *move)
{
	(void)self, (void)forced;
	struct path_context *c = m->path;
	struct ensemble candidates;
	struct sampler_random s;
	double u[4], r[4];
	mutation_draw_uniforms(m, BLOCK_BREAKUP, u);
	mutation_draw_uniforms(m, BLOCK_LENGTHS, r);
	*move = (struct proposal_move){.log_density = {INFINITY, INFINITY}};
	if (x->edges > 0) {
		double v[4];
		mutation_draw_uniforms(m, BLOCK_AROUND, v);
		sampler_random_init(&s, m->seed, RNG_BIDIRECTIONAL_MUTATION, m->chain, m->step);
		ensemble_draw_containing(c, &s.base, x, v, &candidates);
		move->log_density[MUTATION_REVERSE] = -log(candidates.total);
	}
	const struct ensemble_lengths n = ensemble_draw_lengths(c, r, 1, 1);
	sampler_random_init(&s, m->seed, RNG_CHAIN, m->chain, m->step);
	ensemble_draw(c, &s.base, &n, &candidates);
	if (!ensemble_choose(c, &candidates, u[0], y))
		return PROPOSAL_BLACK;
	move->last = y->edges;
	move->log_density[MUTATION_FORWARD] = -log(candidates.total);
	return PROPOSAL_MADE;
}

static double log_weight(struct mutation_ctx *m, struct full_path *into, const struct proposal_move *move,
			 enum mutation_direction direction)
{
	(void)m, (void)into;
	return -move->log_density[direction];
}

/* The cost of this mutation grows with the length of sub-paths, whereas that of a walk hardly does; it pays if it gets
 * about a third of the time. Its cost relative to hslt's, and the weights with the least error at equal time: 2.8 and
 * 0.15 to 0.4 in displaced (at most 12 edges), 4 and 0.1 in the demo (16), 12.5 and 0.01 to 0.06 in veach-door (33). */
static double default_weight(const struct render_summary *scene)
{
	const double weight_times_depth = 2.4, min_weight = 0.05, max_weight = 0.3;
	if (render_effect_is_on(scene, "half-vectors"))
		return fmin(fmax(weight_times_depth / scene->useful_depth, min_weight), max_weight);
	/* It costs ten times as much as `rejoin`: with half the weight, cornell-box has 20 % less relMSE x time. */
	return 0.05;
}

const struct mutation_ops mutation_bidirectional = {
	.name = "bidirectional",
	.summary = "a new path, one of those formed by a pair of sub-paths",
	.is_independent = true,
	.default_weight = default_weight,
	.propose = propose,
	.log_weight = log_weight,
};
