/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/mutation/strategy.h"

/* The choices of b and c for one proposal, forced or to be drawn. */
struct choice {
	int b, c;
};

static unsigned fixed_b(int b, unsigned k)
{
	return b == STRATEGY_CAMERA ? k : (unsigned)b;
}

/* Sets the weights of b: those of the heuristic, except for values that the strategy cannot use. */
static void weigh_b(const struct strategy *s, const struct choice *choice, const struct mutation_ctx *m,
		    const struct full_path *x, double *weight)
{
	s->heuristic->weigh_b(m->path, x, weight);
	if (choice->c >= 0)
		for (unsigned i = 0; i <= x->edges && i <= (unsigned)choice->c; i++)
			weight[i] = 0;
}

/* Sets the weights of c in the same way: no walk passes an event in a medium. */
static void weigh_c(const struct strategy *s, const struct mutation_ctx *m, const struct full_path *x, unsigned b,
		    double *weight)
{
	s->heuristic->weigh_c(m->path, x, b, weight);
	bool past_medium = false;
	for (unsigned i = b; i-- > 0;) {
		weight[i] = past_medium ? 0 : weight[i];
		past_medium = past_medium || x->v[i].kind == VERTEX_MEDIUM;
	}
}

/* Returns log P(b) P(c | b) of x by the heuristic; forced choices have probability 1. -INFINITY: never chosen. */
static double log_choice(const struct strategy *s, const struct choice *choice, struct mutation_ctx *m,
			 const struct full_path *x, unsigned b, unsigned c)
{
	double *weight = m->scratch.weight, p = 1;
	if (choice->b == STRATEGY_DRAWN) {
		weigh_b(s, choice, m, x, weight);
		p *= heuristic_probability(weight, x->edges + 1, b);
	}
	if (choice->c == STRATEGY_DRAWN && b > 0) {
		weigh_c(s, m, x, b, weight);
		p *= heuristic_probability(weight, b, c);
	}
	return log(p);
}

static bool choose_breakup(const struct strategy *s, const struct choice *choice, struct mutation_ctx *m,
			   const struct full_path *x, struct breakup *out)
{
	double *weight = m->scratch.weight, r[4];
	unsigned k = x->edges;
	mutation_draw_uniforms(m, BLOCK_BREAKUP, r);
	if (choice->b == STRATEGY_DRAWN) {
		weigh_b(s, choice, m, x, weight);
		out->b = heuristic_choose(weight, k + 1, r[0]);
	} else {
		out->b = fixed_b(choice->b, k);
	}
	if (out->b > k)
		return false;
	out->c = 0;
	if (out->b > 0 && choice->c == STRATEGY_DRAWN) {
		weigh_c(s, m, x, out->b, weight);
		out->c = heuristic_choose(weight, out->b, r[1]);
	} else if (out->b > 0) {
		out->c = (unsigned)choice->c;
	}
	if (!breakup_is_allowed(x, out->b, out->c))
		return false;
	if (out->b == 0 && !path_can_be_hit(m->path, &x->v[0]))
		return false;
	out->log_choice = log_choice(s, choice, m, x, out->b, out->c);
	return out->log_choice > -INFINITY;
}

enum proposal_result strategy_propose(const struct mutation_ops *self, struct mutation_ctx *m,
				      const struct mutation_forced_choice *forced, struct full_path *x,
				      struct full_path *y, struct proposal_move *move)
{
	const struct strategy *s = self->strategy;
	struct choice choice = {forced->b >= 0 ? forced->b : s->b, forced->c >= 0 ? forced->c : s->c};
	struct breakup breakup = {.moves_halfvecs = s->moves_halfvecs,
				  .moves_wavelength = s->moves_wavelength,
				  .moves_aperture = s->moves_aperture};
	if (EFFECT_IS_ON(m->path->w, scattering))
		breakup.moves_wavelength = s->moves_wavelength_in_media;
	if (!choose_breakup(s, &choice, m, x, &breakup))
		return PROPOSAL_INAPPLICABLE;
	const struct world *w = m->path->w;
	breakup.moves_emitter = s->moves_emitter && w->effects.emitter_move && breakup.b > 0 && breakup.c == 0 &&
				w->emitters[x->v[0].emitter].ops->point_inverse;
	enum proposal_result result = breakup_propose(m, &breakup, x, y, move);
	if (result)
		return result;
	double log_reverse_choice = log_choice(s, &choice, m, y, breakup.b, breakup.c);
	move->log_density[MUTATION_REVERSE] += log_reverse_choice;
	return log_reverse_choice > -INFINITY ? PROPOSAL_MADE : PROPOSAL_MODE_CHANGED;
}
