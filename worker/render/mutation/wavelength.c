/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Proposes another wavelength for the same path (sec. 6). If specular vertices are dispersive, the path has to move:
 * all half vectors are kept, and the walk finds the path that has them at the new wavelength.
 */
#include "worker/render/mutation/strategy.h"
#include "worker/render/world/effects_text.h"

static const struct strategy strategy = {&heuristic_roughness, STRATEGY_CAMERA, 0, .moves_wavelength = true,
					 .moves_wavelength_in_media = true};

static bool must_move_vertices(const struct full_path *x)
{
	for (unsigned j = 1; j < x->edges; j++)
		if (x->v[j].is_delta && x->v[j].bsdf->is_dispersive)
			return true;
	return false;
}

static enum proposal_result propose(const struct mutation_ops *self, struct mutation_ctx *m,
				    const struct mutation_forced_choice *forced, struct full_path *x,
				    struct full_path *y, struct proposal_move *move)
{
	if (!EFFECT_IS_ON(m->path->w, colour))
		return PROPOSAL_INAPPLICABLE;
	if (must_move_vertices(x)) {
		const struct mutation_forced_choice whole_path = {(int)x->edges, 0};
		return strategy_propose(self, m, forced->b >= 0 || forced->c >= 0 ? forced : &whole_path, x, y, move);
	}
	const struct breakup unmoved = {.b = x->edges, .c = x->edges, .moves_wavelength = true};
	return breakup_propose(m, &unmoved, x, y, move);
}

static double default_weight(const struct render_summary *scene)
{
	return render_effect_is_on(scene, "wavelength") ? 0.05 : 0;
}

const struct mutation_ops mutation_wavelength = {
	.name = "wavelength",
	.summary = "another wavelength; the path moves where it must",
	.default_weight = default_weight,
	.strategy = &strategy,
	.propose = propose,
	.log_weight = breakup_log_weight,
};
