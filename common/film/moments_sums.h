/* SPDX-License-Identifier: Apache-2.0 */
/* The contents of struct moments, for canvas_moments.c, which adds to it, and common/estimate, which reads it. */
#ifndef COMMON_FILM_MOMENTS_SUMS_H
#define COMMON_FILM_MOMENTS_SUMS_H

#include "common/film/exact_sum.h"
#include "common/film/path_class.h"
#include "common/plan/plan.h"

enum { MOMENTS_PREFIX, MOMENTS_OPEN, MOMENTS_SETS = 3 };

/* First moments are times, at most the number of mutations: the chains of one lease make at most 2^42. */
#define MOMENTS_GRID 0x1p20
struct moments {
	struct plan plan;
	uint32_t per_lease, leases, tiles; /* sequences of a lease; leases of a round */
	int64_t *first;			   /* [set][lease][sequence][tile] */
	int64_t *second;		   /* [set][lease][tile] */
	struct exact_sum *time;		   /* [set][group][class] */
	struct exact_sum *bootstrap;	   /* [group][class] */
};

static inline size_t moments_classes(const struct moments *m)
{
	return (size_t)m->plan.groups * PATH_CLASSES;
}

#endif
