/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Half vectors of a whole path and their derivatives (Hanika, Kaplanyan, Dachsbacher 2015, sec. 3.1 and 3.2; the
 * paper's indices: x_0 on the light, i towards the light, o towards the camera).
 *
 * h_j = (h.s, h.t) / (h.n), h along i_j + eta_j o_j, eta_j = n_o / n_i, in the shading frame (s, t, n) of x_j: the
 * plane-plane half vector with the signed h.n, so that neither the sign of h nor the order of the neighbours matters.
 * Index-matched transmission (eta = 1 exactly): h_j = ((i + o).s, (i + o).t).
 *
 *   a = d h_j / d x_{j-1},   b = d h_j / d x_j,   c = d h_j / d x_{j+1}        rows s, t; columns tangent coordinates
 *
 * Tangent coordinates are lengths along the orthonormal (du, dv) of the vertex that moves, in the plane of its
 * geometric normal. An emitter at infinity moves as a direction (solid angle), a delta emitter across the direction to
 * its neighbour. Derivatives are exact for shading normals that are not the geometric ones, too: the frame turns with
 * both. h.n = 0: h is infinite and all derivatives are 0, so that the matrix is singular. All else is finite. Pure; one
 * thread a call; nothing allocates.
 */
#ifndef WORKER_RENDER_HALFVEC_CONSTRAINT_H
#define WORKER_RENDER_HALFVEC_CONSTRAINT_H

#include "worker/render/math/mat2.h"
#include "worker/render/path/full_path.h"

struct constraint {
	vec2 h;
	mat2 a, b, c;
};

/* Constraints of the inner vertices c+1..b-1 of x, k[j] for vertex j. Needs edges c..b-1 joined and the inner modes. */
void constraints_of(const struct world *w, const struct full_path *x, unsigned b, unsigned c, struct constraint *k);
/* Computes h only. */
vec2 halfvec_of(const struct full_path *x, unsigned j);

/*
 * The block tridiagonal system of the vertices c+1..b-1 between the fixed ends x_b and x_c (b - c >= 2):
 *   a_j dx_{j-1} + b_j dx_j + c_j dx_{j+1} = dh_j
 * eliminated from the camera's end (L_{b-1} = b_{b-1}, L_j = b_j - c_j L_{j+1}^-1 a_{j+1}); where a block L_j is
 * singular or nearly so although the matrix is not, by a banded elimination with pivoting.
 */
enum constraint_end { CONSTRAINT_OK, CONSTRAINT_SINGULAR };

struct constraint_factors {
	mat2 inverse[FULL_PATH_MAX_VERTICES]; /* by vertex, of L_j */
	double det[FULL_PATH_MAX_VERTICES];   /* of L_j */
	/* banded factors, when pivoted: the layout is constraint_system.inc's */
	double band[2 * FULL_PATH_MAX_VERTICES][10];
};

struct constraint_single {
	mat2_single a, b, c;
};
struct constraint_factors_single {
	mat2_single inverse[FULL_PATH_MAX_VERTICES];
	float det[FULL_PATH_MAX_VERTICES];
	float band[2 * FULL_PATH_MAX_VERTICES][10];
	struct constraint_single k[FULL_PATH_MAX_VERTICES]; /* vertices of the factored system */
};

struct constraint_system {
	unsigned b, c;
	bool pivoted;
	unsigned char order[2 * FULL_PATH_MAX_VERTICES]; /* of the banded factors */
	double log_det;					 /* log |det M| */
	double log_transfer; /* log |det d x_{b-1} / d x_c| with all h held: prod |det a_j| / |det M| */
	union {
		struct constraint_factors wide;
		struct constraint_factors_single narrow;
	};
};

/* One system in double, another with its matrices and vectors in float: derivatives, half vectors and what is solved
 * for are double for both. */
struct constraint_solver {
	enum constraint_end (*factor)(const struct constraint *k, unsigned b, unsigned c,
				      struct constraint_system *out);
	/* The same without the two logarithms, which only `factor` computes. */
	enum constraint_end (*factor_to_solve)(const struct constraint *k, unsigned b, unsigned c,
					       struct constraint_system *out);
	/* dx for given dh, both by vertex index c+1..b-1. Finite or infinite; in float also where the solution is
	 * out of range. */
	void (*solve)(const struct constraint *k, const struct constraint_system *m, const vec2 *dh, vec2 *dx);
	/* Ray differentials (sec. 3.1): D_j = d x_{b-1} / d h_j, for j = c+1..b-1. CONSTRAINT_SINGULAR: not
	 * available. */
	enum constraint_end (*differentials)(const struct constraint *k, unsigned b, unsigned c, mat2 *d);
};

#endif
