/*
 * The rays that the renderer sends through the door (worker/geom/accel.h), kept to be sent again. The bench is linked with
 * --wrap for the door's functions, so that the renderer itself knows nothing of it. One thread.
 */
#ifndef TESTS_BENCH_RECORD_H
#define TESTS_BENCH_RECORD_H

#include "worker/geom/accel.h"

enum ray_kind { RAY_CLOSEST, RAY_SEGMENT, RAY_INFINITE };

struct recorded_ray {
	enum ray_kind kind;
	struct ray_end from, to;
	vec3 d;
	double t_min, t_max;
};

void record_start(struct recorded_ray *rays, size_t room);
size_t record_stop(void); /* how many came; those beyond the room are not kept */

#endif
