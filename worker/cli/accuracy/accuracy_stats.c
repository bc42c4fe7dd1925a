/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/accuracy/accuracy_stats.h"

#include "common/base/list.h"
#include "common/estimate/quantile.h"

#include <math.h>
#include <stdlib.h>

double stats_t_quantile(double level, double degrees)
{
	/* The square of Student's t has an F distribution with 1 and n degrees of freedom. */
	double n = degrees < 1 ? 1 : degrees > 1e9 ? 1e9 : degrees;
	return sqrt(f_quantile(1 - level, 1, n));
}

static void mean_and_variance(const double *x, size_t n, double *mean, double *variance_of_mean)
{
	double sum = 0, square = 0;
	for (size_t i = 0; i < n; i++)
		sum += x[i];
	*mean = sum / (double)n;
	for (size_t i = 0; i < n; i++)
		square += (x[i] - *mean) * (x[i] - *mean);
	*variance_of_mean = n > 1 ? square / (double)n / (double)(n - 1) : 0;
}

struct interval stats_relative_difference(const double *a, size_t a_count, const double *b, size_t b_count,
					  double level, double *t)
{
	double ma, mb, va, vb;
	mean_and_variance(a, a_count, &ma, &va);
	mean_and_variance(b, b_count, &mb, &vb);
	if (t)
		*t = 0;
	if (a_count < 2 || b_count < 1 || !(mb > 0))
		return (struct interval){NAN, NAN, NAN};
	/* The error of the ratio of the means includes that of b. */
	double ratio = ma / mb;
	vb *= ratio * ratio;
	double variance = (va + vb) / (mb * mb);
	double degrees_divisor = va * va / (double)(a_count - 1) + (b_count > 1 ? vb * vb / (double)(b_count - 1) : 0);
	double degrees = degrees_divisor > 0 ? (va + vb) * (va + vb) / degrees_divisor : 1e9, sd = sqrt(variance);
	if (t)
		*t = sd > 0 ? (ratio - 1) / sd : 0;
	double half_width = stats_t_quantile(level, degrees) * sd;
	return (struct interval){ratio - 1, ratio - 1 - half_width, ratio - 1 + half_width};
}

struct interval stats_median(double *x, size_t count)
{
	if (count == 0)
		return (struct interval){NAN, NAN, NAN};
	qsort(x, count, sizeof *x, compare_doubles);
	double middle = 0.5 * (x[(count - 1) / 2] + x[count / 2]), n = (double)count;
	/* The number of values below the true median is binomial with probability 1/2. The rank is its quantile at
	 * 2.5 %, by the normal approximation. */
	double rank = floor(0.5 * n - 0.5 - 0.98 * sqrt(n));
	size_t k = rank > 0 ? (size_t)rank : 0;
	return (struct interval){middle, x[k], x[count - 1 - k]};
}

static bool dominates(const struct front_point *j, const struct front_point *i, double z)
{
	if (j->changes_image)
		return false;
	double margin = z * hypot(i->log_sd, j->log_sd), error_difference = j->log_error - i->log_error;
	bool less_error = error_difference < -margin, is_bias_bounded = !(j->bias_upper > 1.5 * i->bias_upper);
	bool more_bias = j->bias_lower_single > i->bias_lower_single || !is_bias_bounded;
	bool less_bias = j->bias_upper < i->bias_lower_joint ||
			 (i->bias_lower_joint > 0 && j->bias_lower_single == 0 && is_bias_bounded);
	return (less_error && !more_bias) || (less_bias && !(error_difference > margin));
}

void stats_front(const struct front_point *p, size_t n, double level, size_t *dominated_by)
{
	double z = n > 1 ? stats_t_quantile(2 * level / (double)(n - 1), 1e9) : 0;
	for (size_t i = 0; i < n; i++) {
		dominated_by[i] = i;
		for (size_t j = 0; j < n; j++)
			if (j != i && dominates(&p[j], &p[i], z) &&
			    (dominated_by[i] == i || p[j].log_error < p[dominated_by[i]].log_error))
				dominated_by[i] = j;
	}
}
