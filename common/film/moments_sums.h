/* SPDX-License-Identifier: Apache-2.0 */
/* The contents of struct moments, for canvas_moments.c, which adds to it, and common/estimate, which reads it. */
#ifndef COMMON_FILM_MOMENTS_SUMS_H
#define COMMON_FILM_MOMENTS_SUMS_H

#include "common/film/exact_sum.h"
#include "common/film/path_class.h"
#include "common/plan/plan.h"

/* The sets of sums: the prefix, then the open rounds of even and odd number. */
enum { MOMENTS_PREFIX, MOMENTS_OPEN, MOMENTS_SETS = 3 };

/* Moments are stored in units of 1 / MOMENTS_GRID. They are at most the number of mutations, 2^42 for the chains of one
 * lease (moments_check_range), so that sums stay below 2^62. */
#define MOMENTS_GRID 0x1p20
struct moments {
	struct plan plan;
	uint32_t sequences_per_lease;
	uint32_t lease_count;		    /* per round */
	uint32_t tile_count;		    /* of the crop */
	int64_t *first_moments;		    /* [set][lease][sequence][tile] */
	int64_t *second_moments;	    /* [set][lease][tile] */
	struct exact_sum *class_time;	    /* [set][group][class] */
	struct exact_sum *bootstrap_energy; /* [group][class] */
};

static inline size_t moments_class_count(const struct moments *m)
{
	return (size_t)m->plan.groups * PATH_CLASSES;
}

#endif
