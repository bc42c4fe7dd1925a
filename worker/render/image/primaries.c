/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/image/primaries.h"

#include "worker/render/math/mat4.h"

#include <float.h>

static const struct primaries bt709_primaries = {{0.64f, 0.30f, 0.15f, 0.3127f}, {0.33f, 0.60f, 0.06f, 0.3290f}};

/* Returns false if the primaries may be off a common line only because of rounding to float. */
static bool are_independent(const mat4 *columns)
{
	double volume = fabs(mat4_det3(*columns)), box = 1;
	for (int k = 0; k < 3; k++)
		box *= hypot(hypot(columns->m[0][k], columns->m[1][k]), columns->m[2][k]);
	return volume > FLT_EPSILON * box;
}

/* Computes the matrix from RGB to XYZ. Its columns are the XYZ of the primaries, scaled so that (1,1,1) is the white
 * point with Y = 1. */
static bool primaries_to_xyz(const struct primaries *p, mat4 *m)
{
	mat4 columns = mat4_identity(), inverse;
	for (int k = 0; k < 3; k++) {
		columns.m[0][k] = p->x[k];
		columns.m[1][k] = p->y[k];
		columns.m[2][k] = 1.0 - p->x[k] - p->y[k];
	}
	if (!are_independent(&columns) || !mat4_invert(columns, &inverse))
		return false;
	vec3 white = {p->x[3] / (double)p->y[3], 1, (1.0 - p->x[3] - p->y[3]) / p->y[3]};
	vec3 scale = mat4_vector(&inverse, white);
	*m = mat4_mul(columns, mat4_scale(scale));
	return true;
}

bool primaries_are_bt709(const struct primaries *p)
{
	for (int k = 0; k < 4; k++)
		if (p->x[k] != bt709_primaries.x[k] || p->y[k] != bt709_primaries.y[k])
			return false;
	return true;
}

bool primaries_to_bt709(const struct primaries *p, double m[3][3])
{
	mat4 file_to_xyz, bt709_to_xyz, xyz_to_bt709;
	if (!primaries_to_xyz(p, &file_to_xyz) || !primaries_to_xyz(&bt709_primaries, &bt709_to_xyz) ||
	    !mat4_invert(bt709_to_xyz, &xyz_to_bt709))
		return false;
	mat4 file_to_bt709 = mat4_mul(xyz_to_bt709, file_to_xyz);
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++) {
			m[i][j] = file_to_bt709.m[i][j];
			if (!isfinite(m[i][j]))
				return false;
		}
	return true;
}
