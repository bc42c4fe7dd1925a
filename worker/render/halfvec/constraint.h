/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Half vectors of a whole path and their derivatives (Hanika, Kaplanyan, Dachsbacher 2015, sec. 3.1 and 3.2; indices as
 * in the paper: x_0 is on the light, i points towards the light, o towards the camera).
 *
 * h_j = (h.s, h.t) / (h.n), where h = i_j + eta_j o_j, eta_j = n_o / n_i, and (s, t, n) is the shading frame of x_j.
 * This is the plane-plane half vector, but divided by the signed h.n, so that neither the sign of h nor the order of
 * the neighbours matters. For index-matched transmission (eta = 1 exactly), h_j = ((i + o).s, (i + o).t).
 *
 *     a = d h_j / d x_{j-1},   b = d h_j / d x_j,   c = d h_j / d x_{j+1}        rows s, t; columns tangent coordinates
 *
 * Tangent coordinates are lengths along the orthonormal (du, dv) of the vertex that moves, in the plane perpendicular
 * to its geometric normal. An emitter at infinity moves as a direction (solid angle), a delta emitter perpendicular to
 * the direction to its neighbour. The derivatives are also exact where the shading normal differs from the geometric
 * normal: the frame turns with both. If h.n = 0, h is infinite and all derivatives are 0, so that the matrix is
 * singular. All other results are finite. Pure; one thread per call; nothing allocates.
 */
#ifndef WORKER_RENDER_HALFVEC_CONSTRAINT_H
#define WORKER_RENDER_HALFVEC_CONSTRAINT_H

#include "worker/render/math/mat2.h"
#include "worker/render/path/full_path.h"

struct constraint {
	vec2 h;
	mat2 a, b, c;
};

/* Computes the constraints of the inner vertices c+1..b-1 of x; k[j] is that of vertex j. Edges c..b-1 must be joined
 * and the modes of the inner vertices set. */
void constraints_compute(const struct world *w, const struct full_path *x, unsigned b, unsigned c,
			 struct constraint *k);
/* Computes only h_j. */
vec2 halfvec_of(const struct full_path *x, unsigned j);

/*
 * The block tridiagonal system of the vertices c+1..b-1 between the fixed ends x_b and x_c (b - c >= 2):
 *
 *     a_j dx_{j-1} + b_j dx_j + c_j dx_{j+1} = dh_j
 *
 * It is eliminated from the camera's end (L_{b-1} = b_{b-1}, L_j = b_j - c_j L_{j+1}^-1 a_{j+1}). Where a block L_j is
 * singular or nearly so although the matrix is not, a banded elimination with pivoting is used instead.
 */
enum constraint_result { CONSTRAINT_OK, CONSTRAINT_SINGULAR };

struct constraint_factors {
	mat2 inverse[FULL_PATH_VERTICES_MAX]; /* inverse of L_j, by vertex */
	double det[FULL_PATH_VERTICES_MAX];   /* determinant of L_j */
	/* The factors of the banded elimination, if pivoted: constraint_system.inc describes their layout. */
	double band[2 * FULL_PATH_VERTICES_MAX][10];
};

struct constraint_single {
	mat2_single a, b, c;
};
struct constraint_factors_single {
	mat2_single inverse[FULL_PATH_VERTICES_MAX];
	float det[FULL_PATH_VERTICES_MAX];
	float band[2 * FULL_PATH_VERTICES_MAX][10];
	/* The constraints of the factored system, in float. */
	struct constraint_single k[FULL_PATH_VERTICES_MAX];
};

struct constraint_system {
	unsigned b, c;
	bool is_pivoted;
	unsigned char pivot_offset[2 * FULL_PATH_VERTICES_MAX]; /* pivots of the banded factors */
	double log_det;						/* log |det M| */
	double log_transfer; /* log |det d x_{b-1} / d x_c| with all h held fixed: prod |det a_j| / |det M| */
	union {
		struct constraint_factors wide;
		struct constraint_factors_single narrow;
	};
};

/* There are two solvers, one in double and one whose matrices and vectors are float. Derivatives, half vectors and
 * solutions are double for both. */
struct constraint_solver {
	enum constraint_result (*factor)(const struct constraint *k, unsigned b, unsigned c,
					 struct constraint_system *out);
	/* Like factor, but without the two logarithms. */
	enum constraint_result (*factor_to_solve)(const struct constraint *k, unsigned b, unsigned c,
						  struct constraint_system *out);
	/* Computes dx for a given dh, both indexed by vertex c+1..b-1. The result may be infinite but is never NaN; in
	 * float it is also infinite where the solution is out of range. */
	void (*solve)(const struct constraint *k, const struct constraint_system *m, const vec2 *dh, vec2 *dx);
	/* Computes the ray differentials (sec. 3.1) D_j = d x_{b-1} / d h_j, for j = c+1..b-1.
	 * CONSTRAINT_SINGULAR: they are not available. */
	enum constraint_result (*differentials)(const struct constraint *k, unsigned b, unsigned c, mat2 *d);
};

#endif
