/*
 * Step sizes in half vector space by ray differentials (Hanika, Kaplanyan, Dachsbacher 2015, sec. 3.3; Kaplanyan, Hanika,
 * Dachsbacher 2014, sec. 6): a half vector moves as far as takes the path across some pixels, but not farther than its lobe is
 * wide. Steps are Gaussian along the axes of the footprint: h' = h + u diag(sigma) g, g standard normal.
 * Pure; one thread a call; nothing allocates.
 */
#ifndef WORKER_HALFVEC_STEPSIZE_H
#define WORKER_HALFVEC_STEPSIZE_H

#include "worker/halfvec/constraint.h"

struct halfvec_step {
	mat2 u;          /* a rotation */
	double sigma[2]; /* deviations along its columns, in slopes; above 0 and finite */
};

/* The film offset per pixel as offsets of x_{k-1} in its tangent plane (du, dv): columns x, y of the film. Not finite where
 * the plane is seen edge on. */
mat2 halfvec_footprint(const struct world *w, const struct whole_path *x);

/* Steps of the vertices c_end+1 .. b-1 that are not exactly specular, from their constraints. Where x_k is not x_b the traced
 * part moves on the film already, and lobes alone set the steps. */
void halfvec_steps(const struct path_context *c, const struct whole_path *x, const struct constraint *k, unsigned b,
		   unsigned c_end, struct halfvec_step *step);

/* log density of a step per area of slopes. */
double halfvec_step_log_pdf(const struct halfvec_step *s, vec2 dh);

#endif
