/* SPDX-License-Identifier: Apache-2.0 */
/*
 * log T(x -> y) of breakups, multiplied out per area of every vertex that moves, by sections 4 and 5 of the paper. Of
 * worker/render/mutation only the weights of the heuristic are used. Tests compare the result with the program's
 * products, in which common factors cancel. In the measure of path.h; delta distributions are dropped from both f and
 * T.
 */
#ifndef TESTS_WORKER_MUTATION_EXPLICIT_H
#define TESTS_WORKER_MUTATION_EXPLICIT_H

#include "worker/render/halfvec/constraint_system.h"
#include "worker/render/mutation/heuristic.h"
#include "worker/render/mutation/mutation.h"

#include <string.h>

/* As published in sec. 4: standard deviation of the film step as a share of the film's smaller side, and of half
 * vectors in lobe widths. */
#define EXPLICIT_FILM 0.02
#define EXPLICIT_HALFVEC 0.01
/* In media: standard deviations of the logarithm of distances, and of slopes relative to a direction. */
#define EXPLICIT_DISTANCE 0.02
#define EXPLICIT_DIRECTION 0.02

/* Returns log |n.i| |d omega_i / d h_par| at vertex j, with the cosine `n_i` for |n.i|. */
static inline double explicit_log_halfvec_jacobian(const struct full_path *x, unsigned j, double n_i)
{
	vec2 h = halfvec_of(x, j);
	if (full_path_eta(x, j) == 1 && (x->v[j].mode & BSDF_TRANSMIT)) /* h is (i + o)_xy, of area |n.i| d omega */
		return log(fabs(n_i) / fabs(frame_to_local(&x->v[j].x.sh, x->edge[j - 1].w).z));
	double length2 = 1 + vec2_dot(h, h), eta = full_path_eta(x, j);
	vec3 n = vec3_scale(1 / sqrt(length2), (vec3){h.x, h.y, 1});
	vec3 o = frame_to_local(&x->v[j].x.sh, x->edge[j].w),
	     i = frame_to_local(&x->v[j].x.sh, vec3_neg(x->edge[j - 1].w));
	double ih = vec3_dot(i, n), sum = ih + eta * vec3_dot(o, n);
	return log(fabs(n_i) * sum * sum / fabs(ih)) - 1.5 * log(length2);
}

static inline double explicit_log_gauss(double dx, double dy, double sigma)
{
	return -0.5 * (dx * dx + dy * dy) / (sigma * sigma) - log(2 * M_PI * sigma * sigma);
}

/* Returns the half vector of x_j turned into the frame of y_j (sec. 4), by angles. */
static inline vec2 explicit_turned_halfvec(const struct full_path *x, const struct full_path *y, unsigned j)
{
	vec2 h = halfvec_of(x, j);
	vec3 d = vec3_sub(y->v[j].x.p, x->v[j].x.p);
	vec3 a = frame_to_local(&x->v[j].x.sh, d), b = frame_to_local(&y->v[j].x.sh, d);
	double least = 1e-3 * vec3_length(d);
	if (!(hypot(a.x, a.y) > least && hypot(b.x, b.y) > least))
		return h;
	double turn = atan2(b.y, b.x) - atan2(a.y, a.x);
	return (vec2){cos(turn) * h.x - sin(turn) * h.y, sin(turn) * h.x + cos(turn) * h.y};
}

/* Returns the logarithm of the factor from density per solid angle, at y_{j+1}, to density per area at y_j. */
static inline double explicit_log_area_factor(const struct full_path *y, unsigned j)
{
	return log(path_cosine(&y->v[j], y->edge[j].w) / y->edge[j].distance2);
}

/* Returns the logarithm of the further factor of a vertex in a medium, from the density of the distance; adds to
 * *choice the logarithm of the density of the distance's logarithm. */
static inline double explicit_log_distance_factor(const struct full_path *x, const struct full_path *y, unsigned j,
						  double *choice)
{
	if (y->v[j].kind != VERTEX_MEDIUM)
		return 0;
	double from = 0.5 * log(x->edge[j].distance2), to = 0.5 * log(y->edge[j].distance2);
	double steps = (to - from) / EXPLICIT_DISTANCE;
	*choice += -0.5 * steps * steps - log(sqrt(2 * M_PI) * EXPLICIT_DISTANCE);
	return -to;
}

/* Returns the logarithm of the density per solid angle of the direction in which y leaves a scattering event. */
static inline double explicit_log_direction_density(const struct full_path *x, const struct full_path *y, unsigned j)
{
	struct frame a = frame_around(x->edge[j].w), b = frame_around(y->edge[j].w);
	vec3 from = frame_to_world(&b, frame_to_local(&a, vec3_neg(x->edge[j - 1].w))), to = vec3_neg(y->edge[j - 1].w);
	double cosine = vec3_dot(from, to), slope = vec3_length(vec3_cross(from, to)) / cosine;
	return explicit_log_gauss(slope, 0, EXPLICIT_DIRECTION) - 3 * log(cosine);
}

/* The part of the path traced from the camera. *log_choices: the symmetric choices alone, of the film point and of
 * the half vectors. */
static inline double explicit_log_traced_part(const struct path_context *c, const struct full_path *x,
					      const struct full_path *y, unsigned b, double *log_choices)
{
	unsigned k = y->edges;
	struct camera camera_at_x;
	const struct camera *camera = world_camera_at(c->w, &y->v[k].x, &camera_at_x);
	*log_choices = 0;
	if (b == k)
		return 0;
	*log_choices = explicit_log_gauss(y->film[0] - x->film[0], y->film[1] - x->film[1],
					  EXPLICIT_FILM * fmin(camera->width, camera->height));
	double sum = log(camera_jac_film_from_solid(camera, vec3_neg(y->edge[k - 1].w))) +
		     explicit_log_area_factor(y, k - 1) + explicit_log_distance_factor(x, y, k - 1, log_choices);
	for (unsigned j = k - 1; j > b; j--) {
		const struct path_vertex *v = &y->v[j];
		if (v->kind == VERTEX_MEDIUM) {
			*log_choices += explicit_log_direction_density(x, y, j);
		} else if (v->is_delta) {
			/* the density is 1 per solid angle projected on the geometric normal */
			sum += log(fabs(vec3_dot(v->x.ng, y->edge[j - 1].w)));
		} else {
			vec2 h = halfvec_of(y, j), from = explicit_turned_halfvec(x, y, j);
			double sigma = EXPLICIT_HALFVEC * 0.5 *
				       (fmin(x->v[j].bsdf->min_alpha, 1) + fmin(v->bsdf->min_alpha, 1));
			*log_choices += explicit_log_gauss(h.x - from.x, h.y - from.y, sigma);
			sum -= explicit_log_halfvec_jacobian(y, j, 1);
		}
		sum += explicit_log_area_factor(y, j - 1) + explicit_log_distance_factor(x, y, j - 1, log_choices);
	}
	return sum + *log_choices;
}

/* The part between the ends b and c, at y, with steps dh drawn at x; dh NULL: no steps. */
static inline double explicit_log_walked_part(const struct path_context *c, const struct full_path *x,
					      const struct full_path *y, unsigned b, unsigned c_end, const vec2 *dh,
					      double sign)
{
	static struct constraint at_x[FULL_PATH_VERTICES_MAX], at_y[FULL_PATH_VERTICES_MAX];
	static struct constraint_system system;
	static struct halfvec_step step[FULL_PATH_VERTICES_MAX];
	if (b < c_end + 2)
		return 0;
	constraints_compute(c->w, y, b, c_end, at_y);
	constraint_double.factor(at_y, b, c_end, &system);
	double sum = system.log_det;
	if (dh) {
		constraints_compute(c->w, x, b, c_end, at_x);
		halfvec_compute_steps(c, x, at_x, b, c_end, step);
	}
	for (unsigned j = c_end + 1; j < b; j++) {
		if (y->v[j].is_delta)
			sum += explicit_log_halfvec_jacobian(y, j, vec3_dot(y->v[j].x.ng, y->edge[j - 1].w));
		else if (dh)
			sum += halfvec_step_log_pdf(&step[j], vec2_scale(sign, dh[j]));
	}
	return sum;
}

/* Returns the logarithm of the probability of b and c, if the strategy draws them by the heuristic; otherwise 0. */
static inline double explicit_log_selection(const struct path_context *c, const char *strategy,
					    const struct mutation_forced_choice *forced, const struct full_path *x,
					    unsigned b, unsigned c_end)
{
	double weight[FULL_PATH_VERTICES_MAX], p = 1;
	bool hslt = strcmp(strategy, "hslt") == 0 && forced->b < 0, light = strcmp(strategy, "light") == 0;
	if (hslt || light) {
		heuristic_roughness.weigh_b(c, x, weight);
		/* c = 0 is fixed, so b lies above it. */
		if (light)
			weight[0] = 0;
		p *= heuristic_probability(weight, x->edges + 1, b);
	}
	if (hslt && b > 0) {
		heuristic_roughness.weigh_c(c, x, b, weight);
		for (unsigned i = b; i-- > 1;) /* no half vectors beyond the first scattering event */
			if (x->v[i].kind == VERTEX_MEDIUM)
				for (unsigned beyond = 0; beyond < i; beyond++)
					weight[beyond] = 0;
		p *= heuristic_probability(weight, b, c_end);
	}
	if (strcmp(strategy, "rejoin") == 0) {
		/* 1 for each inner vertex that can be connected to the one before it, 0.1 for an emitter that can be
		 * hit. */
		double found = c->w->emitters[x->v[0].emitter].is_delta ? 0 : 0.1, all = found;
		for (unsigned i = 1; i < x->edges; i++)
			all += !x->v[i].is_delta && (i == 1 || !x->v[i - 1].is_delta);
		p = (b == 0 ? found : 1) / all;
	}
	return log(p);
}

/* Returns whether the strategy also moves x_0, in the random numbers that produce it. */
static inline bool explicit_moves_emitter(const char *strategy, unsigned b, unsigned c_end)
{
	return strcmp(strategy, "light") == 0 || (strcmp(strategy, "rejoin") == 0 && b > 0 && c_end == 0);
}

#endif
