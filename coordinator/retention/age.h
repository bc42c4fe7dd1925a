/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Chooses which finished jobs are cleared of what. By age: films and results, then records. By space: the films of the
 * job that ended first, before any result; then results in the same order. Pure; any thread.
 */
#ifndef COORDINATOR_RETENTION_AGE_H
#define COORDINATOR_RETENTION_AGE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct age_job {
	uint64_t id;
	double order;			     /* later for each that ended later, whatever became of the observed time */
	double ended;			     /* s of observed time at that moment (age_clock.h) */
	uint64_t films, result;		     /* bytes: of what only serves extensions; of result, preview and log */
	bool busy;			     /* somebody fetches its result: it is kept this time */
	bool no_films, no_result, no_record; /* the output */
};

struct age_limits {
	double seconds; /* time after a job's end; 0: forever. Its record is kept AGE_RECORD times as long. */
	uint64_t bytes; /* limit for all finished jobs; 0: none */
};
enum { AGE_RECORD = 10 };

/* Sorts the jobs by their order, the oldest first. now: observed time in s. */
void age_choose(struct age_job *jobs, size_t count, const struct age_limits *l, double now);

#endif
