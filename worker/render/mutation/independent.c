/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Independent proposals: the number of edges is drawn first, then a bidirectional technique, then a path that it
 * generates from new random numbers. The density is summed over all techniques that could have generated the path
 * (Veach 1997, sec. 10.2), so chains change length and class, and f over that density estimates b. `bidirectional` does
 * the same with less variance.
 */
#include "worker/render/math/logsum.h"
#include "worker/render/mutation/mutation.h"
#include "worker/render/path/full_path_density.h"

/* Probability of a path of n + 1 edges relative to one of n. */
#define EDGE_RATIO 0.7

/* Returns the logarithm of the probability of a number of edges. */
static double log_edge_count_probability(const struct path_context *c, unsigned edges)
{
	unsigned n = c->max_depth - c->min_depth + 1, i = edges - c->min_depth;
	return log((1 - EDGE_RATIO) / (1 - pow(EDGE_RATIO, n))) + i * log(EDGE_RATIO);
}

static unsigned choose_edge_count(const struct path_context *c, double u)
{
	unsigned n = c->max_depth - c->min_depth + 1;
	double i = floor(log1p(-u * (1 - pow(EDGE_RATIO, n))) / log(EDGE_RATIO));
	return c->min_depth + (unsigned)fmin(fmax(i, 0), n - 1);
}

/* Directly visible emitters are only found by chance (s = 0). */
static unsigned technique_count(unsigned edges)
{
	return edges == 1 ? 1 : edges + 1;
}

static enum proposal_result propose(const struct mutation_ops *self, struct mutation_ctx *m,
				    const struct mutation_forced_choice *forced, struct full_path *x,
				    struct full_path *y, struct proposal_move *move)
{
	(void)self, (void)forced, (void)x;
	struct path_context *c = m->path;
	double r[4], film[2];
	mutation_draw_uniforms(m, BLOCK_BREAKUP, r);
	unsigned k = choose_edge_count(c, r[0]), n = technique_count(k);
	unsigned s = (unsigned)fmin(floor(r[1] * n), n - 1), t = k + 1 - s;
	*move = (struct proposal_move){.first = 0, .last = k};
	struct sampler_random sampler;
	sampler_random_init(&sampler, m->seed, RNG_CHAIN, m->chain, m->step);
	c->is_unidirectional = true;
	if (path_walk_camera(c, &sampler.base, t, film) < t || (s >= 2 && path_walk_light(c, &sampler.base, s) < s))
		return PROPOSAL_MISSED;
	return full_path_from_subpaths(c, s, 0, k, y) ? PROPOSAL_MADE : PROPOSAL_BLACK;
}

static double log_weight(struct mutation_ctx *m, struct full_path *into, const struct proposal_move *move,
			 enum mutation_direction direction)
{
	(void)move, (void)direction;
	unsigned k = into->edges;
	double log_pdf[FULL_PATH_VERTICES_MAX];
	const bool opaque = m->path->joints_are_opaque;
	/* propose() draws the length first; a joint that passes surfaces would change it. */
	m->path->joints_are_opaque = true;
	full_path_log_technique_pdfs(m->path, into, log_pdf);
	m->path->joints_are_opaque = opaque;
	double log_t = log_edge_count_probability(m->path, k) - log(technique_count(k)) + log_sum_exp(log_pdf, k + 1);
	return full_path_log_f(m->path, into) - log_t;
}

const struct mutation_ops mutation_independent = {
	.name = "independent",
	.summary = "a new path by one bidirectional technique",
	.is_independent = true,
	.propose = propose,
	.log_weight = log_weight,
};
