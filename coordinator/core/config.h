/* SPDX-License-Identifier: Apache-2.0 */
/* The limits and timeouts of a farm. */
#ifndef COORDINATOR_CORE_CONFIG_H
#define COORDINATOR_CORE_CONFIG_H

#include "common/base/error.h"

#include <stdint.h>

enum { FARM_JOBS_DEFAULT = 256 /* default limit on live jobs */ };

struct farm_config {
	uint64_t first_job_id;	 /* ids count up from here and are never reused */
	uint32_t max_jobs;	 /* limit on jobs that have not ended; restored jobs may exceed it */
	uint32_t max_ended_jobs; /* ended jobs that the core remembers for the status; at least 1 */
	uint32_t max_peers;
	uint32_t max_peer_leases; /* limit on the leases held by one worker */
	uint32_t max_job_slots;	  /* limit on groups x parts of one job */
	uint32_t max_faults;	/* a worker is quarantined after this many faults in a row, or wrong results in total */
	uint64_t verify_seed;	/* seed for choosing the leases to verify; workers must not know it */
	double silence_timeout; /* s of silence after which a worker loses its leases */
	double disconnect_timeout;    /* s of silence after which a worker is disconnected */
	double default_lease_timeout; /* s, timeout of a lease while the job has no median lease time */
	double default_copy_delay;    /* s after which an idle worker gets a second copy of a lease while the job has no
					 median */
	/* s after which, if a worker is idle, the older of two copies is given up while the job has no median; doubled
	 * each time for the same lease */
	double copy_timeout;
	/* s, lower limit of the timeout of a lease once the job has a median. */
	double min_lease_timeout;
	double initial_backoff; /* s that a worker pauses with a job after failing with it; doubled each time */
};
void farm_config_init(struct farm_config *c); /* sets first_job_id to 1 and sensible limits */

/* Returns -EINVAL with a sentence if a limit is zero or a time is out of order. */
int farm_config_check(const struct farm_config *c, struct error *e);

#endif
