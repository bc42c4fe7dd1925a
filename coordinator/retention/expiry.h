/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Chooses what to delete of finished jobs. By age: films and results first, records later. By space: films before any
 * result, and results only after that; of both, those of the jobs that ended first. Pure; any thread.
 */
#ifndef COORDINATOR_RETENTION_EXPIRY_H
#define COORDINATOR_RETENTION_EXPIRY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct expiry_job {
	uint64_t id;
	double end_order; /* unlike `ended_at`, it is right even if observed time has started again */
	double ended_at;  /* observed time of the end in s (age_clock.h) */
	/* Bytes of the films, which only serve extensions, and of result, preview and log together. */
	uint64_t film_bytes, result_bytes;
	bool is_in_use; /* a client is fetching the result, so it is kept this time */
	bool must_drop_films, must_drop_result, must_drop_record; /* chosen by expiry_choose_deletions: to be deleted */
};

struct expiry_limits {
	/* Time after a job's end until films and result are deleted; 0: never. The record is kept EXPIRY_RECORD_FACTOR
	 * times as long. */
	double max_age_seconds;
	uint64_t max_bytes; /* limit on the files of all finished jobs together; 0: none */
};
enum { EXPIRY_RECORD_FACTOR = 10 };

/* Sorts the jobs by end_order, the one that ended first in front, and chooses. now: observed time in s. */
void expiry_choose_deletions(struct expiry_job *jobs, size_t count, const struct expiry_limits *l, double now);

#endif
