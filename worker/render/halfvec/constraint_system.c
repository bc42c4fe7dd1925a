/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/halfvec/constraint_system.h"

#include <string.h>

#define REAL double
#define N(name) name
#define F(name) name
#define CONSTRAINT constraint
#define FACTORS wide
#define LAST_INVERSE_MAX 1e10
#define ENTRY_MAX 1e70
#define SCALE_MIN 1e-140
#define ROUNDING 0x1p-46
#define CHECKS_RANGE false
#include "worker/render/halfvec/constraint_system.inc"

static void solve_double(const struct constraint *k, const struct constraint_system *m, const vec2 *dh, vec2 *dx)
{
	solve(k, m, dh, dx);
}

const struct constraint_solver constraint_double = {factor, factor_to_solve, solve_double, differentials};
