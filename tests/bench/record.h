/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Records the rays that the renderer traces through worker/render/geom/accel.h, so that they can be traced again, and
 * how its walks in half-vector space end. The bench wraps these functions at link time (--wrap), so the renderer itself
 * contains no code for it. One thread.
 */
#ifndef TESTS_BENCH_RECORD_H
#define TESTS_BENCH_RECORD_H

#include "worker/render/geom/accel.h"
#include "worker/render/halfvec/walk.h"

enum ray_kind { RAY_CLOSEST, RAY_SEGMENT, RAY_INFINITE };

struct recorded_ray {
	enum ray_kind kind;
	struct ray_end from, to;
	vec3 d;
	double t_min, t_max;
};

void record_start(struct recorded_ray *rays, size_t capacity);
size_t record_stop(void); /* returns the number of rays kept; rays beyond the buffer are dropped */

enum { WALK_ENDS = WALK_ITERATION_LIMIT + 1 };
struct recorded_walks { /* since the program started, by enum walk_result */
	uint64_t forward[WALK_ENDS], backward[WALK_ENDS];
	uint64_t occluded; /* walks in `forward` that arrived, but whose path has an occluded edge */
};
extern struct recorded_walks record_walks;

#endif
