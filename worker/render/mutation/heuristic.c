/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/mutation/heuristic.h"

/* Weight of the two extremes: half vectors only (b = k) and tracing only (b = 0). */
#define END_WEIGHT 0.1

static double roughness(const struct path_vertex *v)
{
	if (v->kind == VERTEX_MEDIUM)
		return 1;
	return v->is_delta ? 0 : fmin(v->bsdf->mean_alpha, 1);
}

/* P(b = i) ~ a_i, with weight 0.1 for both ends. If all inner vertices are specular, or there are none, half vectors
 * have nothing to move; an emitter that cannot be hit is not found by tracing. */
static void weigh_b(const struct path_context *c, const struct full_path *x, double *weight)
{
	unsigned k = x->edges;
	bool has_rough_vertex = false;
	weight[0] = path_can_be_hit(c, &x->v[0]) ? END_WEIGHT : 0;
	for (unsigned i = 1; i < k; i++) {
		weight[i] = roughness(&x->v[i]);
		has_rough_vertex |= weight[i] > 0;
	}
	weight[k] = has_rough_vertex ? END_WEIGHT : 0;
}

/* P(c = i | b) ~ a_i |x_i - x_{i+1}|^2, where a of the emitter is 1 and the scene's diameter
 * stands for infinite distances. */
static void weigh_c(const struct path_context *c, const struct full_path *x, unsigned b, double *weight)
{
	/* For b = k, nothing moves unless some vertex with a half vector lies between: for a pinhole, c = k -
	 * 1 would be the identity. */
	bool something_moves = b < x->edges;
	for (unsigned i = b; i-- > 0;) {
		double distance2 =
			x->v[i].kind == VERTEX_INFINITE ? 4 * c->w->radius * c->w->radius : x->edge[i].distance2;
		weight[i] = something_moves ? (i == 0 ? 1 : roughness(&x->v[i])) * distance2 : 0;
		something_moves |= i > 0 && !x->v[i].is_delta;
	}
}

const struct heuristic heuristic_roughness = {weigh_b, weigh_c};

static double sum_weights(const double *weight, unsigned n)
{
	double sum = 0;
	for (unsigned i = 0; i < n; i++)
		sum += weight[i];
	return sum;
}

double heuristic_probability(const double *weight, unsigned n, unsigned i)
{
	return weight[i] > 0 ? weight[i] / sum_weights(weight, n) : 0;
}

unsigned heuristic_choose(const double *weight, unsigned n, double u)
{
	double remaining = u * sum_weights(weight, n);
	unsigned chosen = n;
	for (unsigned i = 0; i < n; i++) {
		if (!(weight[i] > 0))
			continue;
		chosen = i;
		if (remaining < weight[i])
			return i;
		remaining -= weight[i];
	}
	return chosen;
}
