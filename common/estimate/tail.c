/* SPDX-License-Identifier: Apache-2.0 */
#include "common/estimate/tail.h"

#include "common/base/mem.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>

int tail_init(struct tail *t, size_t most)
{
	*t = (struct tail){.most = most, .y = mem_alloc(2 * most, sizeof *t->y)};
	return t->y ? 0 : -ENOMEM;
}

void tail_fini(struct tail *t)
{
	mem_free(t->y);
	*t = (struct tail){0};
}

void tail_clear(struct tail *t)
{
	t->held = 0;
	t->least = 0;
}

static int compare_descending(const void *a, const void *b)
{
	double x = *(const double *)a, y = *(const double *)b;
	return (x < y) - (x > y);
}

void tail_settle(struct tail *t)
{
	qsort(t->y, t->held, sizeof *t->y, compare_descending);
	if (t->held < t->most)
		return;
	t->held = t->most;
	t->least = t->y[t->most - 1];
}

void tail_add(struct tail *t, double y)
{
	if (!(y > t->least) || !isfinite(y))
		return;
	t->y[t->held++] = y;
	if (t->held == 2 * t->most)
		tail_settle(t);
}

double tail_index(const struct tail *t, size_t k)
{
	double sum = 0;
	if (k == 0 || t->held <= k)
		return 1;
	for (size_t i = 0; i < k; i++)
		sum += log(t->y[i] / t->y[k]);
	return sum > 0 ? (double)k / sum : INFINITY;
}

/* The 95th percentile of the standard normal distribution. */
static const double one_sided = 1.6449;

double tail_index_least(double index, size_t k)
{
	return index * (1 + one_sided / sqrt((double)k));
}

double tail_evi(const struct tail *t, size_t k)
{
	double first = 0, second = 0;
	if (k == 0 || t->held <= k)
		return 1;
	for (size_t i = 0; i < k; i++) {
		double x = log(t->y[i] / t->y[k]);
		first += x / (double)k;
		second += x * x / (double)k;
	}
	double spread = second - first * first;
	return spread > 0 ? first + 1 - 0.5 * second / spread : -INFINITY;
}
