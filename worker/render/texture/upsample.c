/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/texture/upsample.h"

#include "worker/render/math/cie.h"

#include <stdbool.h>

static double det3(const double a[3][3])
{
	return a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) - a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
	       a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]);
}

/* Solves a x = b by Cramer's rule. Returns false if there is no finite solution. */
static bool solve3(const double a[3][3], const double b[3], double x[3])
{
	double d = det3(a);
	if (d == 0 || !isfinite(d))
		return false;
	for (int j = 0; j < 3; j++) {
		double m[3][3];
		for (int r = 0; r < 3; r++)
			for (int k = 0; k < 3; k++)
				m[r][k] = k == j ? b[r] : a[r][k];
		x[j] = det3(m) / d;
		if (!isfinite(x[j]))
			return false;
	}
	return true;
}

/* Computes the matrix from RGB to XYZ: its columns are the primaries of Rec. 709, scaled so that (1,1,1) gives
 * `white`. */
static void rec709_matrix(const double white[3], double m[3][3])
{
	static const double xy[3][2] = {{0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}};
	double primary[3][3], scale[3];
	for (int k = 0; k < 3; k++) {
		primary[0][k] = xy[k][0] / xy[k][1];
		primary[1][k] = 1;
		primary[2][k] = (1 - xy[k][0] - xy[k][1]) / xy[k][1];
	}
	solve3(primary, white, scale);
	for (int r = 0; r < 3; r++)
		for (int k = 0; k < 3; k++)
			m[r][k] = primary[r][k] * scale[k];
}

void upsample_init(struct upsample *s, int step_nm)
{
	*s = (struct upsample){.count = (CIE_COUNT - 1) / step_nm + 1};
	double y_sum = 0;
	for (int i = 0; i < CIE_COUNT; i++)
		y_sum += cie_observer[i][1] * cie_d65[i];
	for (int i = 0; i < s->count; i++)
		s->t[i] = (CIE_FIRST_NM + i * step_nm - UPSAMPLE_CENTER_NM) / UPSAMPLE_HALF_NM;
	for (int i = 0; i < CIE_COUNT; i++) {
		int cell = i / step_nm;
		double b = (double)(i - cell * step_nm) / step_nm;
		for (int k = 0; k < 3; k++) {
			double w = cie_observer[i][k] * cie_d65[i] / y_sum;
			s->white[k] += w;
			s->weight[cell][k] += (1 - b) * w;
			if (b > 0)
				s->weight[cell + 1][k] += b * w;
		}
	}
	rec709_matrix(s->white, s->xyz_from_rgb);
}

static void xyz_from_coefficients(const struct upsample *s, const double c[3], double xyz[3], double jacobian[3][3])
{
	for (int k = 0; k < 3; k++)
		xyz[k] = jacobian[k][0] = jacobian[k][1] = jacobian[k][2] = 0;
	for (int i = 0; i < s->count; i++) {
		double t = s->t[i], x = (c[0] * t + c[1]) * t + c[2];
		double r = 1 / sqrt(1 + x * x), value = 0.5 + 0.5 * x * r, slope = 0.5 * r * r * r;
		for (int k = 0; k < 3; k++) {
			double w = s->weight[i][k], d = w * slope;
			xyz[k] += w * value;
			jacobian[k][0] += d * t * t;
			jacobian[k][1] += d * t;
			jacobian[k][2] += d;
		}
	}
}

static double lab_curve(double x, double *slope)
{
	const double knee = 6.0 / 29.0;
	if (x > knee * knee * knee) {
		double root = cbrt(x);
		*slope = root / (3 * x);
		return root;
	}
	*slope = 1 / (3 * knee * knee);
	return x * *slope + 4.0 / 29.0;
}

/* Converts XYZ to L a b, with the derivatives with respect to XYZ. */
static void lab_from_xyz(const struct upsample *s, const double xyz[3], double lab[3], double d[3][3])
{
	double f[3], slope[3];
	for (int k = 0; k < 3; k++) {
		f[k] = lab_curve(xyz[k] / s->white[k], &slope[k]);
		slope[k] /= s->white[k];
	}
	lab[0] = 116 * f[1] - 16;
	lab[1] = 500 * (f[0] - f[1]);
	lab[2] = 200 * (f[1] - f[2]);
	const double rows[3][3] = {
		{0, 116 * slope[1], 0}, {500 * slope[0], -500 * slope[1], 0}, {0, 200 * slope[1], -200 * slope[2]}};
	for (int r = 0; r < 3; r++)
		for (int k = 0; k < 3; k++)
			d[r][k] = rows[r][k];
}

static double norm3(const double a[3])
{
	return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
}

/* Computes residual = Lab(c) - target, and its Jacobian with respect to c. Returns the norm of the residual. */
static double compute_residual(const struct upsample *s, const double target[3], const double c[3], double residual[3],
			       double jacobian[3][3])
{
	double xyz[3], by_c[3][3], lab[3], by_xyz[3][3];
	xyz_from_coefficients(s, c, xyz, by_c);
	lab_from_xyz(s, xyz, lab, by_xyz);
	for (int r = 0; r < 3; r++) {
		residual[r] = lab[r] - target[r];
		for (int k = 0; k < 3; k++)
			jacobian[r][k] =
				by_xyz[r][0] * by_c[0][k] + by_xyz[r][1] * by_c[1][k] + by_xyz[r][2] * by_c[2][k];
	}
	return norm3(residual);
}

double upsample_fit(const struct upsample *s, const double rgb[3], double tolerance, double c[3])
{
	enum { ITERATIONS = 60 };
	double xyz[3], target[3], unused[3][3];
	for (int k = 0; k < 3; k++)
		xyz[k] = s->xyz_from_rgb[k][0] * rgb[0] + s->xyz_from_rgb[k][1] * rgb[1] +
			 s->xyz_from_rgb[k][2] * rgb[2];
	lab_from_xyz(s, xyz, target, unused);

	double r[3], j[3][3], error = compute_residual(s, target, c, r, j), damping = 1e-6;
	for (int i = 0; i < ITERATIONS && error > tolerance; i++) {
		/* Levenberg-Marquardt: the damping is proportional to the diagonal, so that units do not matter. */
		double a[3][3], b[3], step[3], next[3], next_r[3], next_j[3][3];
		for (int p = 0; p < 3; p++) {
			b[p] = -(j[0][p] * r[0] + j[1][p] * r[1] + j[2][p] * r[2]);
			for (int q = 0; q < 3; q++)
				a[p][q] = (j[0][p] * j[0][q] + j[1][p] * j[1][q] + j[2][p] * j[2][q]) *
					  (p == q ? 1 + damping : 1);
		}
		if (!solve3(a, b, step))
			break;
		for (int k = 0; k < 3; k++)
			next[k] = c[k] + step[k];
		double next_error = compute_residual(s, target, next, next_r, next_j);
		if (!(next_error < error)) {
			damping *= 10;
			if (damping > 1e12)
				break;
			continue;
		}
		damping *= 0.1;
		error = next_error;
		for (int k = 0; k < 3; k++) {
			c[k] = next[k];
			r[k] = next_r[k];
			for (int q = 0; q < 3; q++)
				j[k][q] = next_j[k][q];
		}
	}
	return error;
}
