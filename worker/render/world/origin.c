/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/world/origin.h"

#include <stdlib.h>

#define MIXED 0x1p-12
#define WIDE 0x1p11

static double middle_of(const struct box *b, unsigned axis)
{
	return 0.5 * (vec3_along(b->low, axis) + vec3_along(b->high, axis));
}

int weighted_value_compare(const void *a, const void *b)
{
	const struct weighted_value *x = a, *y = b;
	return (x->at > y->at) - (x->at < y->at);
}

static double median(struct weighted_value *w, uint32_t count)
{
	double total = 0, passed = 0;
	qsort(w, count, sizeof *w, weighted_value_compare);
	for (uint32_t i = 0; i < count; i++)
		total += w[i].weight;
	for (uint32_t i = 0; i < count; i++) {
		passed += w[i].weight;
		if (passed >= 0.5 * total)
			return w[i].at;
	}
	return w[count - 1].at;
}

/* Returns the extent of the smallest shape. */
static double least_extent(const struct box *shapes, uint32_t count)
{
	double least = INFINITY;
	for (uint32_t i = 0; i < count; i++)
		least = fmin(least, box_extent(&shapes[i]));
	return least;
}

static bool is_mixed(double least, const struct box *all)
{
	return least > 0 && least < MIXED * box_extent(all);
}

double origin_wide_from(const struct box *all, const struct box *shapes, uint32_t count)
{
	double least = least_extent(shapes, count);
	return is_mixed(least, all) ? WIDE * least : INFINITY;
}

vec3 origin_choose(const struct box *all, const struct box *shapes, uint32_t count, struct weighted_value *room)
{
	double at[3], least = least_extent(shapes, count);
	for (unsigned axis = 0; axis < 3; axis++) {
		at[axis] = middle_of(all, axis);
		if (!is_mixed(least, all))
			continue;
		for (uint32_t i = 0; i < count; i++)
			room[i] = (struct weighted_value){middle_of(&shapes[i], axis), least / box_extent(&shapes[i])};
		at[axis] = median(room, count);
	}
	return (vec3){at[0], at[1], at[2]};
}
