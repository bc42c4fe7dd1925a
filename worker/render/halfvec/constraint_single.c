/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/halfvec/constraint_single.h"

#include <string.h>

#define REAL float
#define N(name) name##_single
#define F(name) name##f
#define CONSTRAINT constraint_single
#define FACTORS narrow
#define LAST_INVERSE_MAX 1e4F
#define ENTRY_MAX 1e12F
#define SCALE_MIN 1e-15F
#define ROUNDING 0x1p-17F
#define CHECKS_RANGE true
#include "worker/render/halfvec/constraint_system.inc"

static mat2_single block_to_single(mat2 m)
{
	return (mat2_single){(float)m.xx, (float)m.xy, (float)m.yx, (float)m.yy};
}

static void constraints_to_single(const struct constraint *k, unsigned b, unsigned c, struct constraint_single *out)
{
	unsigned j = c + 1;
	do
		out[j] = (struct constraint_single){block_to_single(k[j].a), block_to_single(k[j].b),
						    block_to_single(k[j].c)};
	while (++j < b);
}

static enum constraint_result factor_single(const struct constraint *k, unsigned b, unsigned c,
					    struct constraint_system *m)
{
	constraints_to_single(k, b, c, m->narrow.k);
	return factor(m->narrow.k, b, c, m);
}

static enum constraint_result factor_single_to_solve(const struct constraint *k, unsigned b, unsigned c,
						     struct constraint_system *m)
{
	constraints_to_single(k, b, c, m->narrow.k);
	return factor_to_solve(m->narrow.k, b, c, m);
}

/* Right-hand sides have the range of doubles, so they are scaled by their largest entry. */
static void solve_single(const struct constraint *k, const struct constraint_system *m, const vec2 *dh, vec2 *dx)
{
	(void)k;
	vec2_single right_side[FULL_PATH_VERTICES_MAX], x[FULL_PATH_VERTICES_MAX];
	double largest = 0;
	for (unsigned j = m->c + 1; j < m->b; j++)
		largest = fmax(largest, fmax(fabs(dh[j].x), fabs(dh[j].y)));
	double unit = largest > 0 ? largest : 1;
	for (unsigned j = m->c + 1; j < m->b; j++)
		right_side[j] = (vec2_single){(float)(dh[j].x / unit), (float)(dh[j].y / unit)};
	bool solved = solve(m->narrow.k, m, right_side, x);
	for (unsigned j = m->c + 1; j < m->b; j++)
		dx[j] = solved ? vec2_scale(unit, (vec2){(double)x[j].x, (double)x[j].y}) : (vec2){INFINITY, INFINITY};
}

static enum constraint_result differentials_single(const struct constraint *k, unsigned b, unsigned c, mat2 *d)
{
	struct constraint_single narrow[FULL_PATH_VERTICES_MAX];
	mat2_single out[FULL_PATH_VERTICES_MAX];
	constraints_to_single(k, b, c, narrow);
	if (differentials(narrow, b, c, out) != CONSTRAINT_OK)
		return CONSTRAINT_SINGULAR;
	for (unsigned j = c + 1; j < b; j++)
		d[j] = (mat2){(double)out[j].xx, (double)out[j].xy, (double)out[j].yx, (double)out[j].yy};
	return CONSTRAINT_OK;
}

const struct constraint_solver constraint_single = {factor_single, factor_single_to_solve, solve_single,
						    differentials_single};
