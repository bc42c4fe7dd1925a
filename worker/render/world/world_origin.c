/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/world/world_origin.h"

#include <stdlib.h>

#define MIXED_SCALES_MAX 0x1p-12
#define WIDE_EXTENT_RATIO 0x1p11

static double box_middle(const struct box *b, unsigned axis)
{
	return 0.5 * (vec3_component(b->min, axis) + vec3_component(b->max, axis));
}

int weighted_value_compare(const void *a, const void *b)
{
	const struct weighted_value *x = a, *y = b;
	return (x->value > y->value) - (x->value < y->value);
}

static double median(struct weighted_value *w, uint32_t count)
{
	double total = 0, cumulative = 0;
	qsort(w, count, sizeof *w, weighted_value_compare);
	for (uint32_t i = 0; i < count; i++)
		total += w[i].weight;
	for (uint32_t i = 0; i < count; i++) {
		cumulative += w[i].weight;
		if (cumulative >= 0.5 * total)
			return w[i].value;
	}
	return w[count - 1].value;
}

/* Returns the extent of the smallest shape. */
static double smallest_extent(const struct box *shapes, uint32_t count)
{
	double smallest = INFINITY;
	for (uint32_t i = 0; i < count; i++)
		smallest = fmin(smallest, box_extent(&shapes[i]));
	return smallest;
}

static bool has_mixed_scales(double smallest, const struct box *scene_box)
{
	return smallest > 0 && smallest < MIXED_SCALES_MAX * box_extent(scene_box);
}

double world_origin_min_wide_extent(const struct box *scene_box, const struct box *shapes, uint32_t count)
{
	double smallest = smallest_extent(shapes, count);
	return has_mixed_scales(smallest, scene_box) ? WIDE_EXTENT_RATIO * smallest : INFINITY;
}

vec3 world_origin_choose(const struct box *scene_box, const struct box *shapes, uint32_t count,
			 struct weighted_value *scratch)
{
	double center[3], smallest = smallest_extent(shapes, count);
	for (unsigned axis = 0; axis < 3; axis++) {
		center[axis] = box_middle(scene_box, axis);
		if (!has_mixed_scales(smallest, scene_box))
			continue;
		for (uint32_t i = 0; i < count; i++)
			scratch[i] = (struct weighted_value){box_middle(&shapes[i], axis),
							     smallest / box_extent(&shapes[i])};
		center[axis] = median(scratch, count);
	}
	return (vec3){center[0], center[1], center[2]};
}
