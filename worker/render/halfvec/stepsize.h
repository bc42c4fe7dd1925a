/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Step sizes in half vector space (Hanika, Kaplanyan, Dachsbacher 2015, sec. 3.3 and 7): how far a proposal moves the
 * half vectors of the vertices between x_b and x_c. h' = h + U diag(sigma) g, where g are two standard normals. U and
 * sigma are functions of the path, so the reverse step uses those of the proposed path.
 *
 * If the sub-path begins at the camera (b = k), ray differentials give the change of h_j that moves the image by a
 * pixel: E_j = D_j^-1 J, with J = d x_{k-1} / d pixel in the geometric tangent plane at a fixed x_k and D_j = d
 * x_{k-1} / d h_j. With E_j = U diag(s) V^T, sigma is s times the vertex's share of the given number of pixels
 * (shares are in proportion to roughness), limited to alpha / sqrt(pi), the mean |slope| of a Beckmann lobe (times
 * the setting step-scale). Otherwise, and if E_j is not available, U = 1 and sigma is that limit. Pure; any
 * thread; nothing allocates.
 */
#ifndef WORKER_RENDER_HALFVEC_STEPSIZE_H
#define WORKER_RENDER_HALFVEC_STEPSIZE_H

#include "worker/render/halfvec/constraint.h"

struct halfvec_step {
	mat2 rotation;
	double sigma[2]; /* finite and above 0 */
};

/* Returns the standard deviation of a step on the film, in pixels: 2 % of the film's smaller side. */
double halfvec_film_sigma(const struct camera *camera);
/* Returns the width of the narrowest lobe of a vertex that is not specular, in slopes; at most 1. */
double halfvec_lobe_width(const struct path_vertex *v);

/* Computes the steps of those vertices among c_end+1..b-1 that are not specular (step[] of the others is not written)
 * from their constraints. All vertices together move the image by at most halfvec_film_sigma. */
void halfvec_compute_steps(const struct path_context *c, const struct full_path *x, const struct constraint *k,
			   unsigned b, unsigned c_end, struct halfvec_step *step);

/* Returns the step for E = e (any finite entries), with `scale` pixels and sigma at most `limit` (> 0). */
struct halfvec_step halfvec_step_from_matrix(mat2 e, double scale, double limit);

/* Returns h' - h for two standard normals. */
vec2 halfvec_step_sample(const struct halfvec_step *s, double g0, double g1);
/* Returns the logarithm of the density of a step dh, per area of h; -INFINITY if it is out of reach. */
double halfvec_step_log_pdf(const struct halfvec_step *s, vec2 dh);

#endif
