/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/math/mat4.h"

#define RADIANS_PER_DEGREE 0.017453292519943295769

mat4 mat4_identity(void)
{
	return (mat4){{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}};
}

mat4 mat4_mul(mat4 a, mat4 b)
{
	mat4 r;
	for (int i = 0; i < 4; i++)
		for (int j = 0; j < 4; j++) {
			double sum = 0;
			for (int k = 0; k < 4; k++)
				sum += a.m[i][k] * b.m[k][j];
			r.m[i][j] = sum;
		}
	return r;
}

static void swap_rows(double a[4], double b[4])
{
	for (int j = 0; j < 4; j++) {
		double t = a[j];
		a[j] = b[j];
		b[j] = t;
	}
}

/* Uses Gauss-Jordan elimination with partial pivoting; adjugates lose all precision for transforms
 * with a large translation. */
bool mat4_invert(mat4 a, mat4 *inverse)
{
	mat4 r = mat4_identity();
	for (int c = 0; c < 4; c++) {
		int pivot = c;
		for (int i = c + 1; i < 4; i++)
			if (fabs(a.m[i][c]) > fabs(a.m[pivot][c]))
				pivot = i;
		if (!(fabs(a.m[pivot][c]) > 0))
			return false;
		swap_rows(a.m[c], a.m[pivot]);
		swap_rows(r.m[c], r.m[pivot]);
		double scale = 1.0 / a.m[c][c];
		for (int j = 0; j < 4; j++) {
			a.m[c][j] *= scale;
			r.m[c][j] *= scale;
		}
		for (int i = 0; i < 4; i++) {
			if (i == c)
				continue;
			double f = a.m[i][c];
			for (int j = 0; j < 4; j++) {
				a.m[i][j] -= f * a.m[c][j];
				r.m[i][j] -= f * r.m[c][j];
			}
		}
	}
	for (int i = 0; i < 4; i++)
		for (int j = 0; j < 4; j++)
			if (!isfinite(r.m[i][j]))
				return false;
	*inverse = r;
	return true;
}

mat4 mat4_translate(vec3 t)
{
	mat4 r = mat4_identity();
	r.m[0][3] = t.x;
	r.m[1][3] = t.y;
	r.m[2][3] = t.z;
	return r;
}

mat4 mat4_scale(vec3 s)
{
	mat4 r = mat4_identity();
	r.m[0][0] = s.x;
	r.m[1][1] = s.y;
	r.m[2][2] = s.z;
	return r;
}

/* Computes sine and cosine; exact for quarter turns, which are the most common rotations in scene files. */
static void sine_cosine(double degrees, double *s, double *c)
{
	double turn = remainder(degrees, 360.0);
	double quarter = nearbyint(turn / 90.0);
	double rest = (turn - 90.0 * quarter) * RADIANS_PER_DEGREE;
	double rs = sin(rest), rc = cos(rest);
	switch ((int)quarter & 3) {
	case 0:
		*s = rs, *c = rc;
		break;
	case 1:
		*s = rc, *c = -rs;
		break;
	case 2:
		*s = -rs, *c = -rc;
		break;
	default:
		*s = -rc, *c = rs;
		break;
	}
}

mat4 mat4_rotate(vec3 axis, double degrees)
{
	vec3 n = vec3_normalize(axis);
	double s, c;
	sine_cosine(degrees, &s, &c);
	double a[3] = {n.x, n.y, n.z};
	double cross[3][3] = {{0, -n.z, n.y}, {n.z, 0, -n.x}, {-n.y, n.x, 0}};
	mat4 r = mat4_identity();
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			r.m[i][j] = (i == j ? c : 0) + (1 - c) * a[i] * a[j] + s * cross[i][j];
	return r;
}

mat4 mat4_look_at(vec3 origin, vec3 target, vec3 up)
{
	vec3 z = vec3_normalize(vec3_sub(target, origin));
	vec3 x = vec3_normalize(vec3_cross(up, z));
	vec3 y = vec3_cross(z, x);
	return (mat4){{{x.x, y.x, z.x, origin.x}, {x.y, y.y, z.y, origin.y}, {x.z, y.z, z.z, origin.z}, {0, 0, 0, 1}}};
}

double mat4_det3(mat4 a)
{
	vec3 r0 = {a.m[0][0], a.m[0][1], a.m[0][2]}, r1 = {a.m[1][0], a.m[1][1], a.m[1][2]},
	     r2 = {a.m[2][0], a.m[2][1], a.m[2][2]};
	return vec3_dot(r0, vec3_cross(r1, r2));
}

vec3 mat4_point(const mat4 *a, vec3 p)
{
	vec3 v = mat4_vector(a, p);
	return (vec3){v.x + a->m[0][3], v.y + a->m[1][3], v.z + a->m[2][3]};
}

vec3 mat4_vector(const mat4 *a, vec3 v)
{
	return (vec3){a->m[0][0] * v.x + a->m[0][1] * v.y + a->m[0][2] * v.z,
		      a->m[1][0] * v.x + a->m[1][1] * v.y + a->m[1][2] * v.z,
		      a->m[2][0] * v.x + a->m[2][1] * v.y + a->m[2][2] * v.z};
}

vec3 mat4_normal(const mat4 *inverse, vec3 n)
{
	const mat4 *a = inverse;
	return (vec3){a->m[0][0] * n.x + a->m[1][0] * n.y + a->m[2][0] * n.z,
		      a->m[0][1] * n.x + a->m[1][1] * n.y + a->m[2][1] * n.z,
		      a->m[0][2] * n.x + a->m[1][2] * n.y + a->m[2][2] * n.z};
}

bool mat4_is_conformal(const mat4 *a)
{
	const double tolerance = 1e-4;
	vec3 axis[3];
	double first = 0;
	for (int c = 0; c < 3; c++) {
		axis[c] = mat4_column(a, c);
		double length = vec3_length(axis[c]);
		first = c ? first : length;
		if (!(length > 0) || !(fabs(length - first) <= tolerance * first))
			return false;
		axis[c] = vec3_scale(1 / length, axis[c]);
		for (int k = 0; k < c; k++)
			if (fabs(vec3_dot(axis[k], axis[c])) > tolerance)
				return false;
	}
	return true;
}
