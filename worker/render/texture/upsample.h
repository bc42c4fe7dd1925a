/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reflectance spectra from linear Rec. 709 colours: a sigmoid of a quadratic in wavelength (Jakob and Hanika 2019, A
 * Low-Dimensional Function Space for Efficient Spectral Upsampling), fitted in CIELAB under D65. Shared by the renderer
 * and the program that computes its table of coefficients. White is that of the tabulated D65, so that a constant
 * spectrum is exactly grey. Any thread; allocates nothing.
 */
#ifndef WORKER_RENDER_TEXTURE_UPSAMPLE_H
#define WORKER_RENDER_TEXTURE_UPSAMPLE_H

#include <math.h>

/* Coefficients refer to t = (nm - 595) / 235, which runs from -1 to 1: S(c[0] t^2 + c[1] t + c[2]). */
#define UPSAMPLE_CENTER_NM 595.0
#define UPSAMPLE_HALF_NM 235.0
enum { UPSAMPLE_TABLE_SIZE = 32, UPSAMPLE_STEPS_MAX = 471 };

struct upsample {
	int count; /* quadrature points; the spectrum is linear between them */
	double t[UPSAMPLE_STEPS_MAX];
	double weight[UPSAMPLE_STEPS_MAX][3]; /* to XYZ; the weights of Y sum to 1 */
	double white[3];
	double xyz_from_rgb[3][3];
};

static inline double upsample_sigmoid(double x)
{
	return 0.5 + 0.5 * x / sqrt(1 + x * x);
}

void upsample_init(struct upsample *s, int step_nm); /* step_nm: a divisor of 470 */

/* Improves c (start: any finite values) by damped Gauss-Newton steps until the colour difference is below `tolerance`
 * or no step reduces it. Returns the remaining difference, in CIELAB units. rgb in [0,1]. */
double upsample_fit(const struct upsample *s, const double rgb[3], double tolerance, double c[3]);

/* upsample_table_value returns the k-th value of the largest component in the table: they are dense at both ends, where
 * the coefficients change fastest. */
static inline double upsample_smoothstep(double x)
{
	return x * x * (3 - 2 * x);
}
static inline double upsample_table_value(int k)
{
	return upsample_smoothstep(upsample_smoothstep((double)k / (UPSAMPLE_TABLE_SIZE - 1)));
}

#endif
