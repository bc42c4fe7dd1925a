/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/load/load.h"

#include "common/base/mem.h"

#include <math.h>
#include <stdlib.h>

void load_times_add(struct load_times *t, double ms)
{
	if (t->count == t->capacity) {
		size_t capacity = t->capacity ? 2 * t->capacity : 4096;
		float *v = mem_grow(t->ms, t->capacity * sizeof *v, capacity * sizeof *v);
		if (!v)
			load_die("no memory for times");
		t->ms = v;
		t->capacity = capacity;
	}
	t->ms[t->count++] = (float)ms;
}

static int compare_floats(const void *a, const void *b)
{
	const float *x = a, *y = b;
	return (*x > *y) - (*x < *y);
}

double load_times_quantile(struct load_times *t, double fraction)
{
	if (t->count == 0)
		return NAN;
	qsort(t->ms, t->count, sizeof *t->ms, compare_floats);
	size_t i = (size_t)(fraction * (double)t->count);
	return (double)t->ms[i < t->count ? i : t->count - 1];
}
