/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The block tridiagonal system against dense elimination in long double, and against the paths themselves: ends and
 * half vectors are moved slightly, and the path is solved again with 113 bits. The error is at most max(1e-12, 100
 * eps x condition), with each condition in long double; in float, 100 times its eps x condition, where that is below
 * 0.1. HSLT_TEST_ROWS=1 prints one row per case.
 */
#include "tests/worker/render/halfvec/dense.h"
#include "tests/worker/render/halfvec/quad.h"
#include "worker/render/halfvec/constraint_system.h"

#include <fenv.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

static struct constraint k[FULL_PATH_VERTICES_MAX];
static struct constraint_system tested_system;
static struct dense dense;
/* The solver under test, and the size of its rounding errors. */
static const struct constraint_solver *solver = &constraint_double;
static double solver_rounding = 0x1p-53;

static mat2 random_block(struct dice *d, double scale)
{
	return (mat2){scale * dice_between(d, -1, 1), scale * dice_between(d, -1, 1), scale * dice_between(d, -1, 1),
		      scale * dice_between(d, -1, 1)};
}

static void random_system(struct dice *d, unsigned b, unsigned c, double centre)
{
	for (unsigned j = c + 1; j < b; j++) {
		k[j].a = random_block(d, 1);
		k[j].b = random_block(d, centre);
		k[j].c = random_block(d, 1);
	}
}

/* The block that is eliminated first has rank 1 or 0. */
static void make_first_block_singular(struct dice *d, unsigned b, unsigned c)
{
	random_system(d, b, c, 1);
	vec2 p = {dice_between(d, -1, 1), dice_between(d, -1, 1)}, q = {dice_between(d, -1, 1), dice_between(d, -1, 1)};
	double on = dice_uniform(d) < 0.3 ? 0 : 1;
	k[b - 1].b = (mat2){on * p.x * q.x, on * p.x * q.y, on * p.y * q.x, on * p.y * q.y};
}

/* A later block of the elimination vanishes: an image of x_{b-1} lies on a vertex in between. */
static void make_focus(struct dice *d, unsigned b, unsigned c)
{
	random_system(d, b, c, 1);
	mat2 l = k[b - 1].b, adjugate = mat2_adjugate(l);
	k[b - 2].b = mat2_scale(1 / mat2_det(l), mat2_mul(mat2_mul(k[b - 2].c, adjugate), k[b - 1].a));
}

/* A singular matrix: some vector is mapped to 0. */
static void make_singular(struct dice *d, unsigned b, unsigned c)
{
	random_system(d, b, c, 1);
	vec2 x[FULL_PATH_VERTICES_MAX] = {{0, 0}};
	for (unsigned j = c + 1; j < b; j++)
		x[j] = (vec2){dice_between(d, 0.5, 1), dice_between(d, 0.5, 1)};
	for (unsigned j = c + 1; j < b; j++) {
		vec2 rest = {k[j].b.xx * x[j].x, k[j].b.yx * x[j].x};
		if (j > c + 1)
			rest = vec2_add(rest, mat2_apply(k[j].a, x[j - 1]));
		if (j + 1 < b)
			rest = vec2_add(rest, mat2_apply(k[j].c, x[j + 1]));
		k[j].b.xy = -rest.x / x[j].y;
		k[j].b.yy = -rest.y / x[j].y;
	}
}

/* Scales rows and columns, as if slopes at different vertices and lengths at different distances had different units.
 */
static void rescale_randomly(struct dice *d, unsigned b, unsigned c, int most)
{
	double row[FULL_PATH_VERTICES_MAX][2], column[FULL_PATH_VERTICES_MAX + 1][2];
	for (unsigned j = 0; j < FULL_PATH_VERTICES_MAX; j++)
		for (int i = 0; i < 2; i++) {
			row[j][i] = ldexp(1, (int)dice_below(d, (uint32_t)(2 * most + 1)) - most);
			column[j][i] = ldexp(1, (int)dice_below(d, (uint32_t)(2 * most + 1)) - most);
		}
	for (unsigned j = c + 1; j < b; j++) {
		mat2 *block[3] = {&k[j].a, &k[j].b, &k[j].c};
		for (unsigned i = 0; i < 3; i++) {
			const double *of = column[j + i - 1];
			*block[i] = (mat2){block[i]->xx * row[j][0] * of[0], block[i]->xy * row[j][0] * of[1],
					   block[i]->yx * row[j][1] * of[0], block[i]->yy * row[j][1] * of[1]};
		}
	}
}

enum system_recipe { RANDOM, HEAVY_CENTRE, WEAK_CENTRE, FIRST_SINGULAR, FOCUS, SCALED, SCALED_FOCUS };
struct system_kind {
	const char *name;
	enum system_recipe recipe;
	unsigned min_vertices, max_vertices; /* range of the number of inner vertices */
};
static const struct system_kind kinds[] = {
	{"one vertex", RANDOM, 1, 1},
	{"random, 2-6 vertices", RANDOM, 2, 6},
	{"random, 31 vertices", RANDOM, 31, 31},
	{"nearly block diagonal", HEAVY_CENTRE, 2, 12},
	{"weak diagonal blocks", WEAK_CENTRE, 2, 8},
	{"first block singular", FIRST_SINGULAR, 2, 6},
	{"intermediate focus", FOCUS, 3, 8},
	{"rows and columns scaled by 2^+-8", SCALED, 1, 8},
	{"intermediate focus, scaled", SCALED_FOCUS, 3, 8},
};

static void make_system(const struct system_kind *kind, struct dice *d, unsigned b, unsigned c)
{
	switch (kind->recipe) {
	case RANDOM:
	case SCALED:
		random_system(d, b, c, 1);
		break;
	case HEAVY_CENTRE:
		random_system(d, b, c, 10);
		break;
	case WEAK_CENTRE:
		random_system(d, b, c, 1e-3);
		break;
	case FIRST_SINGULAR:
		make_first_block_singular(d, b, c);
		break;
	case FOCUS:
	case SCALED_FOCUS:
		make_focus(d, b, c);
		break;
	}
	if (kind->recipe == SCALED || kind->recipe == SCALED_FOCUS)
		rescale_randomly(d, b, c, 8);
}

struct max_errors {
	double ratio, error, bound;
};

static void note_error(struct max_errors *w, double error, double condition)
{
	double bound = fmax(1e-12, 100 * solver_rounding * condition);
	/* In float, the error bound can exceed the first-order analysis; then nothing can be tested. */
	if (solver == &constraint_single && bound > 0.1)
		return;
	if (!(error / bound <= w->ratio))
		*w = (struct max_errors){error / bound, error, bound};
}

/* Compares each unknown relative to itself, with the condition for errors of the size of the entries. */
static void compare_solution(const vec2 *dh, const vec2 *dx, unsigned c, struct max_errors *w)
{
	long double x[DENSE_SIZE_MAX] = {0};
	for (unsigned r = 0; r < dense.n; r++)
		for (unsigned i = 0; i < dense.n; i++)
			x[r] += dense.inverse[r][i] * (long double)(i & 1 ? dh[c + 1 + i / 2].y : dh[c + 1 + i / 2].x);
	for (unsigned r = 0; r < dense.n; r++) {
		long double bound = 0;
		for (unsigned i = 0; i < dense.n; i++)
			for (unsigned j = 0; j < dense.n; j++)
				bound += fabsl(dense.inverse[r][i]) * dense.scale[i][j] * fabsl(x[j]);
		double actual = r & 1 ? dx[c + 1 + r / 2].y : dx[c + 1 + r / 2].x;
		note_error(w, (double)(fabsl(x[r] - (long double)actual) / fabsl(x[r])), (double)(bound / fabsl(x[r])));
	}
}

/* D_j is a block of the inverse: compared entry by entry in the same way. */
static void compare_differentials(const mat2 *dj, unsigned b, unsigned c, struct max_errors *w)
{
	unsigned row = dense.n - 2;
	for (unsigned j = c + 1; j < b; j++) {
		const double *actual = &dj[j].xx;
		for (unsigned i = 0; i < 4; i++) {
			unsigned r = row + i / 2, s = 2 * (j - c - 1) + (i & 1);
			long double bound = 0;
			for (unsigned p = 0; p < dense.n; p++)
				for (unsigned q = 0; q < dense.n; q++)
					bound += fabsl(dense.inverse[r][p]) * dense.scale[p][q] *
						 fabsl(dense.inverse[q][s]);
			long double expected = dense.inverse[r][s];
			note_error(w, (double)(fabsl(expected - (long double)actual[i]) / fabsl(expected)),
				   (double)(bound / fabsl(expected)));
		}
	}
}

static double long_log_transfer(unsigned b, unsigned c, double *condition)
{
	long double sum = -dense.log_det;
	*condition = dense_det_condition(&dense);
	for (unsigned j = c + 1; j < b; j++) {
		mat2 a = k[j].a;
		long double det = (long double)a.xx * (long double)a.yy - (long double)a.xy * (long double)a.yx;
		sum += logl(fabsl(det));
		*condition += (double)((fabsl((long double)a.xx * (long double)a.yy) +
					fabsl((long double)a.xy * (long double)a.yx)) /
				       fabsl(det));
	}
	return (double)sum;
}

/* Returns whether the system was pivoted; counts in *refused the systems that are singular in float. */
static unsigned compare_system(struct dice *d, unsigned b, unsigned c, struct max_errors *w, size_t *refused)
{
	vec2 dh[FULL_PATH_VERTICES_MAX], dx[FULL_PATH_VERTICES_MAX];
	mat2 dj[FULL_PATH_VERTICES_MAX];
	dense_fill(&dense, k, b, c);
	assert_true(dense_invert(&dense));
	enum constraint_result end = solver->factor(k, b, c, &tested_system);
	if (solver == &constraint_single && end != CONSTRAINT_OK) {
		++*refused;
		return 0;
	}
	assert_int_equal(end, CONSTRAINT_OK);
	for (unsigned j = c + 1; j < b; j++)
		dh[j] = (vec2){dice_between(d, -1, 1), dice_between(d, -1, 1)};
	solver->solve(k, &tested_system, dh, dx);
	compare_solution(dh, dx, c, w);
	double condition, t = long_log_transfer(b, c, &condition);
	note_error(w, fabs(tested_system.log_det - (double)dense.log_det),
		   dense_det_condition(&dense) + fabs(tested_system.log_det));
	note_error(w, fabs(tested_system.log_transfer - t), condition + fabs(tested_system.log_det) + fabs(t));
	end = solver->differentials(k, b, c, dj);
	if (solver == &constraint_single && end != CONSTRAINT_OK) {
		++*refused;
		return tested_system.is_pivoted;
	}
	assert_int_equal(end, CONSTRAINT_OK);
	compare_differentials(dj, b, c, w);
	return tested_system.is_pivoted;
}

static bool print_row(const char *name, const struct max_errors *w)
{
	bool ok = w->ratio <= 1;
	if (getenv("HSLT_TEST_ROWS") || !ok)
		printf("system\t%s\t%.2e\t%.2e\t%s\n", name, w->error, w->bound, ok ? "ok" : "FAILED");
	return ok;
}

static void compare_all(void)
{
	bool all_passed = true;
	for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
		struct dice d = dice_for_test(kinds[i].name);
		struct max_errors w = {0, 0, 0};
		size_t pivoted = 0, refused = 0, count = dice_scaled_count(kinds[i].max_vertices > 12 ? 10 : 300);
		for (size_t s = 0; s < count; s++) {
			unsigned vertex_count = kinds[i].min_vertices +
						dice_below(&d, kinds[i].max_vertices - kinds[i].min_vertices + 1);
			unsigned c = dice_below(&d, (uint32_t)(FULL_PATH_VERTICES_MAX - 1 - vertex_count)),
				 b = c + vertex_count + 1;
			make_system(&kinds[i], &d, b, c);
			pivoted += compare_system(&d, b, c, &w, &refused);
		}
		all_passed = print_row(kinds[i].name, &w) && all_passed;
		print_message("%s: %.2g of the bound, %zu of %zu with pivots, %zu refused\n", kinds[i].name, w.ratio,
			      pivoted, count, refused);
		assert_true(refused <= count / 10 && w.ratio > 1e-4);
		if (solver == &constraint_single)
			continue;
		if (kinds[i].recipe == FIRST_SINGULAR || kinds[i].recipe == FOCUS || kinds[i].recipe == SCALED_FOCUS)
			assert_int_equal(pivoted, count);
		else if (kinds[i].recipe == RANDOM && kinds[i].max_vertices <= 6)
			assert_true(pivoted < count / 3 + 1);
	}
	assert_true(all_passed);
}

static void solver_agrees_with_dense_elimination(void **state)
{
	(void)state;
	compare_all();
}

static void float_solver_agrees_with_dense_elimination(void **state)
{
	(void)state;
	solver = &constraint_single;
	solver_rounding = 0x1p-24;
	compare_all();
	solver = &constraint_double;
	solver_rounding = 0x1p-53;
}

static void singular_systems_are_refused(void **state)
{
	(void)state;
	struct dice d = dice_for_test("singular systems");
	size_t count = dice_scaled_count(2000);
	mat2 dj[FULL_PATH_VERTICES_MAX];
	for (size_t s = 0; s < count; s++) {
		unsigned vertex_count = 1 + dice_below(&d, 8), c = dice_below(&d, 4), b = c + vertex_count + 1;
		make_singular(&d, b, c);
		if (s & 1)
			rescale_randomly(&d, b, c, 8);
		assert_int_equal(constraint_double.factor(k, b, c, &tested_system), CONSTRAINT_SINGULAR);
		assert_int_equal(constraint_double.differentials(k, b, c, dj), CONSTRAINT_SINGULAR);
		/* A slightly perturbed system is not singular. */
		for (unsigned j = c + 1; j < b; j++)
			k[j].b = (mat2){k[j].b.xx * (1 + 1e-6 * dice_uniform(&d)),
					k[j].b.xy * (1 - 1e-6 * dice_uniform(&d)), k[j].b.yx,
					k[j].b.yy * (1 - 1e-6 * dice_uniform(&d))};
		assert_int_equal(constraint_double.factor(k, b, c, &tested_system), CONSTRAINT_OK);
	}
}

/* Entries of any size, some of them equal: no operation is invalid, and accepted results are finite. */
static void check_extremes(const struct constraint_solver *solver_, const double *values)
{
	struct dice d = dice_for_test("extreme systems");
	vec2 dh[FULL_PATH_VERTICES_MAX], dx[FULL_PATH_VERTICES_MAX];
	mat2 dj[FULL_PATH_VERTICES_MAX];
	size_t refused = 0, count = dice_scaled_count(20000);
	for (size_t s = 0; s < count; s++) {
		unsigned vertex_count = 1 + dice_below(&d, s % 50 ? 6 : 31), b = vertex_count + 1, few = s % 2 ? 12 : 9;
		for (unsigned j = 1; j < b; j++) {
			double *entry = &k[j].a.xx;
			for (int q = 0; q < 12; q++)
				entry[q] = values[dice_below(&d, few)] * (s % 3 ? dice_between(&d, 0.1, 1) : 1);
			dh[j] = (vec2){1, -0.5};
		}
		feclearexcept(FE_INVALID);
		bool ok = solver_->factor(k, b, 0, &tested_system) == CONSTRAINT_OK;
		refused += !ok;
		if (ok) {
			solver_->solve(k, &tested_system, dh, dx);
			assert_true(isfinite(tested_system.log_det) && !isnan(tested_system.log_transfer));
			for (unsigned j = 1; j < b; j++)
				if (solver_ == &constraint_single)
					assert_true(!isnan(dx[j].x + fabs(dx[j].y)));
				else
					assert_true(isfinite(dx[j].x) && isfinite(dx[j].y));
		}
		if (solver_->differentials(k, b, 0, dj) == CONSTRAINT_OK)
			for (unsigned j = 1; j < b; j++)
				assert_true(isfinite(mat2_largest(dj[j])));
		assert_false(fetestexcept(FE_INVALID));
	}
	print_message("%zu of %zu refused\n", refused, count);
	assert_true(refused > count / 10 && refused < count);
}

static void extreme_entries_give_finite_results_or_refusals(void **state)
{
	(void)state;
	const double values[] = {0, 1e-310, 1e-200, 1e-69, 1e-20, 1, 1, 1, 1e20, 1e69, 1e200, INFINITY};
	const double in_float[] = {0, 1e-40, 1e-16, 1e-14, 1e-7, 1, 1, 1, 1e6, 1e11, 1e13, INFINITY};
	check_extremes(&constraint_double, values);
	check_extremes(&constraint_single, values);
	check_extremes(&constraint_single, in_float);
}

/* Decisions and results do not depend on the units: scaling by a power of two does not change the choice of pivots or
 * the transfer. */
static void scaling_by_powers_of_two_changes_nothing(void **state)
{
	(void)state;
	struct dice d = dice_for_test("units of the system");
	for (size_t s = 0; s < dice_scaled_count(500); s++) {
		unsigned b = 2 + dice_below(&d, 6);
		struct dice dice_copy = d;
		random_system(&d, b, 0, 1);
		assert_int_equal(constraint_double.factor(k, b, 0, &tested_system), CONSTRAINT_OK);
		bool pivoted = tested_system.is_pivoted;
		double transfer = tested_system.log_transfer;
		random_system(&dice_copy, b, 0, 1);
		for (unsigned j = 1; j < b; j++) {
			k[j].a = mat2_scale(0x1p-60, k[j].a);
			k[j].b = mat2_scale(0x1p-60, k[j].b);
			k[j].c = mat2_scale(0x1p-60, k[j].c);
		}
		assert_int_equal(constraint_double.factor(k, b, 0, &tested_system), CONSTRAINT_OK);
		assert_int_equal(tested_system.is_pivoted, pivoted);
		assert_true(fabs(tested_system.log_transfer - transfer) < 1e-11 * (1 + b * 85));
	}
}

/* Computes the half vectors of a chain of triangles whose vertices were moved by `offset`. */
static void compute_chain_half_vectors(const struct quad_vertex *v, const struct quad_problem *q,
				       const quad offset[][2], unsigned edges, quad h[][2])
{
	struct quad_point_frame p[FULL_PATH_VERTICES_MAX];
	for (unsigned j = 0; j <= edges; j++)
		p[j] = quad_moved_frame(&v[j], offset[j][0], offset[j][1]);
	for (unsigned j = 1; j < edges; j++)
		quad_half_vector(&q[j], &p[j - 1], h[j]);
}

/* Newton's iteration with a constant matrix: so close to the solution it gains ten digits per iteration. */
static void solve_chain(const struct quad_vertex *v, const struct quad_problem *q, const quad target[][2],
			quad offset[][2], unsigned edges)
{
	quad h[FULL_PATH_VERTICES_MAX][2];
	vec2 dh[FULL_PATH_VERTICES_MAX], dx[FULL_PATH_VERTICES_MAX];
	for (int turn = 0; turn < 6; turn++) {
		compute_chain_half_vectors(v, q, (const quad(*)[2])offset, edges, h);
		double scale = 0;
		for (unsigned j = 1; j < edges; j++)
			for (int i = 0; i < 2; i++)
				scale = fmax(scale, fabs((double)(target[j][i] - h[j][i])));
		if (scale == 0)
			return;
		for (unsigned j = 1; j < edges; j++)
			dh[j] = (vec2){(double)((target[j][0] - h[j][0]) / (quad)scale),
				       (double)((target[j][1] - h[j][1]) / (quad)scale)};
		constraint_double.solve(k, &tested_system, dh, dx);
		for (unsigned j = 1; j < edges; j++) {
			offset[j][0] += (quad)scale * (quad)dx[j].x;
			offset[j][1] += (quad)scale * (quad)dx[j].y;
		}
	}
}

/* Returns the derivative of x_{b-1} (b: the camera's end) with respect to coordinate i of the end x_0 (what = 0) or
 * of h_what. */
static vec2 derivative_by_quad(const struct hand *h, unsigned what, int i)
{
	unsigned edges = h->x.edges;
	struct quad_vertex v[FULL_PATH_VERTICES_MAX];
	struct quad_problem q[FULL_PATH_VERTICES_MAX];
	quad base[FULL_PATH_VERTICES_MAX][2], result[2][2];
	const quad still[FULL_PATH_VERTICES_MAX][2] = {{0, 0}};
	const double step = 1e-13;
	for (unsigned j = 0; j <= edges; j++)
		v[j] = quad_vertex_from_surface(h, j);
	for (unsigned j = 1; j < edges; j++)
		q[j] = quad_problem_from_hand(h, j);
	compute_chain_half_vectors(v, q, still, edges, base);
	for (int side = 0; side < 2; side++) {
		quad offset[FULL_PATH_VERTICES_MAX][2] = {{0, 0}}, target[FULL_PATH_VERTICES_MAX][2],
		     move = side ? -step : step;
		memcpy(target, base, sizeof target);
		if (what == 0)
			offset[0][i] = move;
		else
			target[what][i] += move;
		solve_chain(v, q, (const quad(*)[2])target, offset, edges);
		result[side][0] = offset[edges - 1][0];
		result[side][1] = offset[edges - 1][1];
	}
	return (vec2){(double)((result[0][0] - result[1][0]) / (2 * (quad)step)),
		      (double)((result[0][1] - result[1][1]) / (2 * (quad)step))};
}

/* The differences are exact to 1e-20, and the condition of the paths is below 1e4: the tolerance is 100 eps times
 * this condition. */
static void derivatives_agree_with_paths_solved_again(void **state)
{
	(void)state;
	struct dice d = dice_for_test("paths solved again");
	static struct hand h;
	mat2 dj[FULL_PATH_VERTICES_MAX];
	double worst_transfer = 0, worst_differential = 0;
	size_t pivoted = 0;
	for (size_t made = 0; made < dice_scaled_count(100);) {
		unsigned edges = 2 + dice_below(&d, 4);
		if (!hand_make_chain(&h, edges, 0.2, &d))
			continue;
		constraints_compute(&h.w, &h.x, edges, 0, k);
		if (constraint_double.factor(k, edges, 0, &tested_system) != CONSTRAINT_OK)
			continue;
		dense_fill(&dense, k, edges, 0);
		assert_true(dense_invert(&dense));
		if (dense_det_condition(&dense) > 1e4)
			continue;
		made++;
		pivoted += tested_system.is_pivoted;
		mat2 t = mat2_of_columns(derivative_by_quad(&h, 0, 0), derivative_by_quad(&h, 0, 1));
		worst_transfer = fmax(worst_transfer, fabs(log(fabs(mat2_det(t))) - tested_system.log_transfer));
		assert_int_equal(constraint_double.differentials(k, edges, 0, dj), CONSTRAINT_OK);
		for (unsigned j = 1; j < edges; j++) {
			mat2 e = mat2_of_columns(derivative_by_quad(&h, j, 0), derivative_by_quad(&h, j, 1));
			worst_differential =
				fmax(worst_differential, mat2_largest(mat2_sub(e, dj[j])) / mat2_largest(e));
		}
	}
	print_message("solved again: log T %.1e, D %.1e; %zu with pivots\n", worst_transfer, worst_differential,
		      pivoted);
	assert_true(worst_transfer < 1e-10 && worst_differential < 1e-10);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(solver_agrees_with_dense_elimination),
		cmocka_unit_test(float_solver_agrees_with_dense_elimination),
		cmocka_unit_test(singular_systems_are_refused),
		cmocka_unit_test(extreme_entries_give_finite_results_or_refusals),
		cmocka_unit_test(scaling_by_powers_of_two_changes_nothing),
		cmocka_unit_test(derivatives_agree_with_paths_solved_again),
	};
	return cmocka_run_group_tests_name("system", tests, NULL, NULL);
}
