/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Which finished jobs give up what: by age their films and results, then their records; by space the films of the job
 * that ended first before any result, results in the same order. Pure; any thread.
 */
#ifndef COORDINATOR_RETENTION_AGE_H
#define COORDINATOR_RETENTION_AGE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct age_job {
	uint64_t id;
	double ended;			     /* s that had been seen to pass then (seen.h) */
	uint64_t films, result;		     /* bytes: what only serves to go on; result, preview and log */
	bool busy;			     /* somebody fetches its result: it stays this time */
	bool no_films, no_result, no_record; /* the answer */
};

struct age_limits {
	double seconds; /* after a job's end; 0: for ever. Its record stays AGE_RECORD times as long. */
	uint64_t bytes; /* of all finished jobs together; 0: any */
};
enum { AGE_RECORD = 10 };

/* Sorts the jobs, the one that ended first to the front. now: s that have been seen to pass. */
void age_choose(struct age_job *jobs, size_t count, const struct age_limits *l, double now);

#endif
