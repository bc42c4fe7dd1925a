/* SPDX-License-Identifier: Apache-2.0 */
/* Clocks, in seconds. All but the wall clock start at an unspecified time, so only differences of their values have a
 * meaning. Any thread. */
#ifndef COMMON_BASE_CLOCK_H
#define COMMON_BASE_CLOCK_H

#include <time.h>

static inline double clock_read_seconds(clockid_t clock)
{
	struct timespec t;
	clock_gettime(clock, &t);
	return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Seconds since 1970-01-01 UTC. */
static inline double clock_wall_seconds(void)
{
	return clock_read_seconds(CLOCK_REALTIME);
}

/* Seconds of the monotonic clock. */
static inline double clock_seconds(void)
{
	return clock_read_seconds(CLOCK_MONOTONIC);
}

/* Seconds of CPU time of the calling thread. */
static inline double clock_thread_seconds(void)
{
	return clock_read_seconds(CLOCK_THREAD_CPUTIME_ID);
}

#endif
