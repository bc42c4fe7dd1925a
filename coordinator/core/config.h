/* SPDX-License-Identifier: Apache-2.0 */
/* The limits and timeouts of a farm. */
#ifndef COORDINATOR_CORE_CONFIG_H
#define COORDINATOR_CORE_CONFIG_H

#include "common/base/error.h"

#include <stdint.h>

enum { FARM_JOBS = 256 /* default limit of live jobs */ };

struct farm_config {
	uint64_t first_job; /* ids count up from here and are never reused */
	uint32_t max_jobs;  /* limit of jobs that have not ended; restored jobs may exceed it */
	uint32_t max_ended; /* ended jobs kept for the status; at least 1 */
	uint32_t max_peers;
	uint32_t max_peer_leases; /* leases held by one worker */
	uint32_t max_slots;	  /* groups x parts of one job */
	uint32_t max_faults;	  /* before quarantine: faults in a row; wrong results in total */
	uint64_t verify_seed;	  /* seed of the choice of leases to verify, unknown to workers */
	double silent_after;	  /* s of silence before a worker loses its leases */
	double forget_after;	  /* s of silence before it is disconnected */
	double first_timeout;	  /* timeout of a lease before the job has a median */
	double first_copy;	  /* before the job has a median: after this time an idle worker gets a second copy */
	double idle_timeout; /* and after this time the older of two copies is given up; doubled each time for the same
				lease */
	double min_timeout;
	double first_pause; /* pause of a worker that failed with a job, doubled each time */
};
void farm_config_init(struct farm_config *c); /* first_job 1 and sensible limits */

int farm_config_check(const struct farm_config *c, struct error *e); /* -EINVAL */

#endif
