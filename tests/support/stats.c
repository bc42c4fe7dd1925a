/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/stats.h"

#include "common/base/mem.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <stdlib.h>

/* Upper regularised incomplete gamma function: series below a + 1, Lentz's continued fraction above. */
static double regularised_gamma_q(double a, double x)
{
	if (x <= 0)
		return 1;
	double front = exp(a * log(x) - x - lgamma(a));
	if (x < a + 1) {
		double term = 1 / a, sum = term;
		for (int n = 1; n < 100000 && fabs(term) > DBL_EPSILON * fabs(sum); n++)
			sum += term *= x / (a + n);
		return 1 - front * sum;
	}
	double b = x + 1 - a, c = 1 / DBL_MIN, d = 1 / b, h = d;
	for (int n = 1; n < 100000; n++) {
		double an = -n * (n - a);
		b += 2;
		d = 1 / (an * d + b);
		c = b + an / c;
		double step = c * d;
		h *= step;
		if (fabs(step - 1) < DBL_EPSILON)
			break;
	}
	return front * h;
}

/* Regularised incomplete beta function by its continued fraction (x below the mean; else the mirror image). */
static double regularised_beta(double a, double b, double x)
{
	if (x <= 0)
		return 0;
	if (x >= 1)
		return 1;
	if (x > (a + 1) / (a + b + 2))
		return 1 - regularised_beta(b, a, 1 - x);
	double front = exp(lgamma(a + b) - lgamma(a) - lgamma(b) + a * log(x) + b * log1p(-x)) / a;
	double c = 1, d = 1 / (1 - (a + b) * x / (a + 1)), h = d;
	for (int m = 1; m < 100000; m++) {
		double even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m));
		d = 1 / (1 + even * d);
		c = 1 + even / c;
		h *= d * c;
		double odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
		d = 1 / (1 + odd * d);
		c = 1 + odd / c;
		h *= d * c;
		if (fabs(d * c - 1) < DBL_EPSILON)
			break;
	}
	return front * h;
}

double stats_chi2_p(double x, double degrees)
{
	return regularised_gamma_q(degrees / 2, x / 2);
}

double stats_student_t_p(double t, double degrees)
{
	return isinf(t) ? 0 : regularised_beta(degrees / 2, 0.5, degrees / (degrees + t * t));
}

struct cell {
	double expected, observed;
};

static int by_expected(const void *a, const void *b)
{
	const struct cell *p = a, *q = b;
	return (p->expected > q->expected) - (p->expected < q->expected);
}

double stats_counts_p(const uint64_t *observed, const double *expected, size_t cells)
{
	struct cell *sorted = mem_alloc(cells, sizeof *sorted);
	assert(sorted);
	for (size_t i = 0; i < cells; i++)
		sorted[i] = (struct cell){expected[i], (double)observed[i]};
	qsort(sorted, cells, sizeof *sorted, by_expected);

	double chi2 = 0, pooled_expected = 0, pooled_observed = 0, p = 1;
	size_t pools = 0;
	for (size_t i = 0; i < cells; i++) {
		pooled_expected += sorted[i].expected;
		pooled_observed += sorted[i].observed;
		if (sorted[i].expected == 0 && sorted[i].observed > 0)
			p = 0;
		/* The last cells, the largest, are added to the last pool. */
		if (pooled_expected >= 5) {
			double d = pooled_observed - pooled_expected;
			chi2 += d * d / pooled_expected;
			pools++;
			pooled_expected = pooled_observed = 0;
		}
	}
	mem_free(sorted);
	return p == 0 ? 0 : pools < 2 ? 1 : stats_chi2_p(chi2, (double)pools - 1);
}

uint64_t stats_seed(const char *name)
{
	uint64_t h = 0xcbf29ce484222325u;
	for (; *name; name++)
		h = (h ^ (unsigned char)*name) * 0x100000001b3u;
	return h;
}

struct stats_mean stats_mean_test(const double *x, size_t n, double expected)
{
	double sum = 0, square_sum = 0;
	for (size_t i = 0; i < n; i++)
		sum += x[i];
	double mean = sum / (double)n;
	for (size_t i = 0; i < n; i++)
		square_sum += (x[i] - mean) * (x[i] - mean);
	double error = sqrt(square_sum / ((double)n * (double)(n - 1)));
	double p = error > 0 ? stats_student_t_p((mean - expected) / error, (double)n - 1) : mean == expected;
	return (struct stats_mean){mean, error, p};
}
