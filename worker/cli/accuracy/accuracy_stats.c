/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/accuracy/accuracy_stats.h"

#include "common/base/list.h"
#include "common/estimate/quantile.h"

#include <math.h>
#include <stdlib.h>

double stats_t(double level, double degrees)
{
	/* The square of Student's t has an F distribution with 1 and n degrees of freedom. */
	double n = degrees < 1 ? 1 : degrees > 1e9 ? 1e9 : degrees;
	return sqrt(f_quantile(1 - level, 1, n));
}

static void moments(const double *x, size_t n, double *mean, double *variance_of_mean)
{
	double sum = 0, square = 0;
	for (size_t i = 0; i < n; i++)
		sum += x[i];
	*mean = sum / (double)n;
	for (size_t i = 0; i < n; i++)
		square += (x[i] - *mean) * (x[i] - *mean);
	*variance_of_mean = n > 1 ? square / (double)n / (double)(n - 1) : 0;
}

struct interval stats_difference(const double *a, size_t a_count, const double *b, size_t b_count, double level,
				 double *t)
{
	double ma, mb, va, vb;
	moments(a, a_count, &ma, &va);
	moments(b, b_count, &mb, &vb);
	if (t)
		*t = 0;
	if (a_count < 2 || b_count < 1 || !(mb > 0))
		return (struct interval){NAN, NAN, NAN};
	/* The error of the ratio of the means includes that of b. */
	double ratio = ma / mb;
	vb *= ratio * ratio;
	double variance = (va + vb) / (mb * mb);
	double below = va * va / (double)(a_count - 1) + (b_count > 1 ? vb * vb / (double)(b_count - 1) : 0);
	double degrees = below > 0 ? (va + vb) * (va + vb) / below : 1e9, sd = sqrt(variance);
	if (t)
		*t = sd > 0 ? (ratio - 1) / sd : 0;
	double half = stats_t(level, degrees) * sd;
	return (struct interval){ratio - 1, ratio - 1 - half, ratio - 1 + half};
}

struct interval stats_median(double *x, size_t count)
{
	if (count == 0)
		return (struct interval){NAN, NAN, NAN};
	qsort(x, count, sizeof *x, double_compare);
	double middle = 0.5 * (x[(count - 1) / 2] + x[count / 2]), n = (double)count;
	/* The number of values below the true median is binomial with probability 1/2. The rank is its quantile at
	 * 2.5 %, by the normal approximation. */
	double rank = floor(0.5 * n - 0.5 - 0.98 * sqrt(n));
	size_t k = rank > 0 ? (size_t)rank : 0;
	return (struct interval){middle, x[k], x[count - 1 - k]};
}

static bool is_better(const struct stats_point *j, const struct stats_point *i, double z)
{
	if (j->other_image)
		return false;
	double apart = z * hypot(i->log_sd, j->log_sd), more = j->log_error - i->log_error;
	bool less_error = more < -apart, known = !(j->bias_bound > 1.5 * i->bias_bound);
	bool more_bias = j->bias_suspect > i->bias_suspect || !known;
	bool less_bias = j->bias_bound < i->bias_seen || (i->bias_seen > 0 && j->bias_suspect == 0 && known);
	return (less_error && !more_bias) || (less_bias && !(more > apart));
}

void stats_front(const struct stats_point *p, size_t n, double level, size_t *by)
{
	double z = n > 1 ? stats_t(2 * level / (double)(n - 1), 1e9) : 0;
	for (size_t i = 0; i < n; i++) {
		by[i] = i;
		for (size_t j = 0; j < n; j++)
			if (j != i && is_better(&p[j], &p[i], z) && (by[i] == i || p[j].log_error < p[by[i]].log_error))
				by[i] = j;
	}
}
