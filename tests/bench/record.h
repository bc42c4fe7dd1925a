/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The rays that the renderer sends through the door (worker/render/geom/accel.h), kept to be sent again, and how its
 * walks in half vector space end. The bench is linked with --wrap for these functions, so that the renderer itself
 * knows nothing of it. One thread.
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

void record_start(struct recorded_ray *rays, size_t room);
size_t record_stop(void); /* how many came; those beyond the room are not kept */

enum { WALK_ENDS = WALK_ITERATIONS + 1 };
struct recorded_walks { /* since the program began, by enum walk_end */
	uint64_t there[WALK_ENDS], back[WALK_ENDS];
	uint64_t occluded; /* of those there that are blocked: they arrived, but an edge is occluded */
};
extern struct recorded_walks record_walks;

#endif
