/* SPDX-License-Identifier: Apache-2.0 */
#include "common/estimate/tail.h"

#include "common/base/mem.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>

int tail_init(struct tail *t, size_t kept_count)
{
	*t = (struct tail){.kept_count = kept_count, .values = mem_alloc(2 * kept_count, sizeof *t->values)};
	return t->values ? 0 : -ENOMEM;
}

void tail_fini(struct tail *t)
{
	mem_free(t->values);
	*t = (struct tail){0};
}

void tail_clear(struct tail *t)
{
	t->count = 0;
	t->threshold = 0;
}

static int compare_descending(const void *a, const void *b)
{
	double x = *(const double *)a, y = *(const double *)b;
	return (x < y) - (x > y);
}

void tail_select_largest(struct tail *t)
{
	qsort(t->values, t->count, sizeof *t->values, compare_descending);
	if (t->count < t->kept_count)
		return;
	t->count = t->kept_count;
	t->threshold = t->values[t->kept_count - 1];
}

void tail_add(struct tail *t, double y)
{
	if (!(y > t->threshold) || !isfinite(y))
		return;
	t->values[t->count++] = y;
	if (t->count == 2 * t->kept_count)
		tail_select_largest(t);
}

double tail_index(const struct tail *t, size_t k)
{
	double sum = 0;
	if (k == 0 || t->count <= k)
		return 1;
	for (size_t i = 0; i < k; i++)
		sum += log(t->values[i] / t->values[k]);
	return sum > 0 ? (double)k / sum : INFINITY;
}

/* The 95th percentile of the standard normal distribution. */
static const double normal_quantile_95 = 1.6449;

double tail_index_critical(double index, size_t k)
{
	return index * (1 + normal_quantile_95 / sqrt((double)k));
}

double tail_extreme_value_index(const struct tail *t, size_t k)
{
	double first = 0, second = 0;
	if (k == 0 || t->count <= k)
		return 1;
	for (size_t i = 0; i < k; i++) {
		double x = log(t->values[i] / t->values[k]);
		first += x / (double)k;
		second += x * x / (double)k;
	}
	double spread = second - first * first;
	return spread > 0 ? first + 1 - 0.5 * second / spread : -INFINITY;
}
