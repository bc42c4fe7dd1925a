/* SPDX-License-Identifier: Apache-2.0 */
#include "common/estimate/quantile.h"

#include <float.h>
#include <math.h>

/* Stirling's series for arguments from 12 on, to which smaller ones are shifted: error below 1e-15. The C library's
 * lgamma is not used, because it writes to a global variable. */
static double log_gamma(double x)
{
	double shift = 1;
	for (; x < 12; x++)
		shift *= x;
	double y = 1 / (x * x);
	double series = (1.0 / 12 - y * (1.0 / 360 - y * (1.0 / 1260 - y * (1.0 / 1680 - y * (1.0 / 1188))))) / x;
	return (x - 0.5) * log(x) - x + 0.91893853320467274178 + series - log(shift);
}

/* Evaluates the continued fraction of the incomplete beta function. It converges in about as many steps as the square
 * root of the larger parameter. */
static double beta_fraction(double x, double a, double b)
{
	double c = 1, d = 1 - (a + b) * x / (a + 1);
	d = 1 / (fabs(d) < DBL_MIN ? DBL_MIN : d);
	double f = d;
	for (int m = 1; m < 1000000; m++) {
		double two = 2 * (double)m;
		double even = m * (b - m) * x / ((a + two - 1) * (a + two));
		d = 1 + even * d;
		c = 1 + even / c;
		d = 1 / (fabs(d) < DBL_MIN ? DBL_MIN : d);
		c = fabs(c) < DBL_MIN ? DBL_MIN : c;
		f *= d * c;
		double odd = -(a + m) * (a + b + m) * x / ((a + two) * (a + two + 1));
		d = 1 + odd * d;
		c = 1 + odd / c;
		d = 1 / (fabs(d) < DBL_MIN ? DBL_MIN : d);
		c = fabs(c) < DBL_MIN ? DBL_MIN : c;
		f *= d * c;
		if (fabs(d * c - 1) < 4 * DBL_EPSILON)
			break;
	}
	return f;
}

/* Returns I_x(a, b). y = 1 - x is passed separately, because it would be inaccurate if x is close to 1. */
static double incomplete_beta(double x, double y, double a, double b)
{
	if (!(x > 0))
		return 0;
	if (!(y > 0))
		return 1;
	double front = exp(log_gamma(a + b) - log_gamma(a) - log_gamma(b) + a * log(x) + b * log(y));
	if (x < (a + 1) / (a + b + 2))
		return front / a * beta_fraction(x, a, b);
	return 1 - front / b * beta_fraction(y, b, a);
}

double f_cdf(double x, double a, double b)
{
	if (!(x > 0))
		return 0;
	return incomplete_beta(a * x / (a * x + b), b / (a * x + b), a / 2, b / 2);
}

double f_quantile(double p, double a, double b)
{
	double low = 0, high = 1;
	while (f_cdf(high, a, b) < p && high < 1e300)
		high *= 2;
	while (low < high * (1 - 0x1p-32)) {
		double middle = low > 0 ? sqrt(low * high) : high / 16;
		if (low == 0 && high < 1e-300)
			return 0;
		if (f_cdf(middle, a, b) < p)
			low = middle;
		else
			high = middle;
	}
	return (double)(float)high;
}
