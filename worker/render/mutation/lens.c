/* SPDX-License-Identifier: Apache-2.0 */
/* The point on the aperture moves; the half vectors up to x_c are kept. */
#include "worker/render/mutation/strategy.h"
#include "worker/render/world/effects_text.h"

/* Any vertex that is not specular is suitable, even x_{k-1}: a new x_k sees it at another film point. */
static void weigh_c(const struct path_context *c, const struct full_path *x, unsigned b, double *weight)
{
	(void)c;
	for (unsigned i = 0; i < b; i++)
		weight[i] = i > 0 && x->v[i].is_delta ? 0 : 1;
}

static const struct heuristic uniform_c = {NULL, weigh_c};
static const struct strategy strategy = {&uniform_c, STRATEGY_CAMERA, STRATEGY_DRAWN, .moves_aperture = true};

static enum proposal_result propose(const struct mutation_ops *self, struct mutation_ctx *m,
				    const struct mutation_forced_choice *forced, struct full_path *x,
				    struct full_path *y, struct proposal_move *move)
{
	if (!EFFECT_IS_ON(m->path->w, aperture))
		return PROPOSAL_INAPPLICABLE;
	return strategy_propose(self, m, forced, x, y, move);
}

static double default_weight(const struct render_summary *scene)
{
	return render_effect_is_on(scene, "aperture") && render_effect_is_on(scene, "half-vectors") ? 0.1 : 0;
}

const struct mutation_ops mutation_lens = {
	.name = "lens",
	.summary = "moves the point on the aperture",
	.default_weight = default_weight,
	.strategy = &strategy,
	.propose = propose,
	.log_weight = breakup_log_weight,
};
