/* SPDX-License-Identifier: Apache-2.0 */
/* The limits and times of a farm. */
#ifndef COORDINATOR_CORE_CONFIG_H
#define COORDINATOR_CORE_CONFIG_H

#include "common/base/error.h"

#include <stdint.h>

enum { FARM_JOBS = 256 /* that live at once, unless told otherwise */ };

struct farm_config {
	uint64_t first_job; /* ids from here on, counted up, never reused */
	uint32_t max_jobs;  /* not ended; those of an earlier run may be more */
	uint32_t max_ended; /* remembered for status; at least 1 */
	uint32_t max_peers;
	uint32_t max_peer_leases; /* held by one worker */
	uint32_t max_slots;	  /* groups x parts of one job */
	uint32_t max_faults;	  /* of a worker in a row; wrong results in all */
	uint64_t verify_seed;	  /* of the choice of leases that are verified: what no worker knows */
	double silent_after;	  /* s without a word: leases taken back */
	double forget_after;	  /* s without a word: hung up */
	double first_timeout;	  /* of a lease before the job has a median */
	double first_copy;	  /* before the job has a median: a worker without other work gets a second copy then */
	double idle_timeout; /* and the older of two copies is given up then, doubled each time for the same lease */
	double min_timeout;
	double first_pause; /* of a worker that failed with a job, doubled each time */
};
void farm_config_init(struct farm_config *c); /* first_job 1 and sane limits */

int farm_config_check(const struct farm_config *c, struct error *e); /* -EINVAL */

#endif
