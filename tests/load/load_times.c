/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/load/load.h"

#include "common/base/mem.h"

#include <math.h>
#include <stdlib.h>

void load_times_add(struct load_times *t, double ms)
{
	if (t->count == t->room) {
		size_t room = t->room ? 2 * t->room : 4096;
		float *v = mem_grow(t->v, t->room * sizeof *v, room * sizeof *v);
		if (!v)
			load_die("no memory for times");
		t->v = v;
		t->room = room;
	}
	t->v[t->count++] = (float)ms;
}

static int by_value(const void *a, const void *b)
{
	const float *x = a, *y = b;
	return (*x > *y) - (*x < *y);
}

double load_times_at(struct load_times *t, double share)
{
	if (t->count == 0)
		return NAN;
	qsort(t->v, t->count, sizeof *t->v, by_value);
	size_t i = (size_t)(share * (double)t->count);
	return (double)t->v[i < t->count ? i : t->count - 1];
}
