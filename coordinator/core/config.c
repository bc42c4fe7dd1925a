/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/config.h"

void farm_config_init(struct farm_config *c)
{
	*c = (struct farm_config){
		.first_job_id = 1,
		.max_jobs = FARM_JOBS_DEFAULT,
		.max_ended_jobs = 1000,
		.max_peers = 4096,
		.max_peer_leases = 256,
		.max_job_slots = 1 << 16,
		.max_faults = 3,
		.silence_timeout = 30,
		.disconnect_timeout = 300,
		.default_lease_timeout = 600,
		.default_copy_delay = 30,
		.copy_timeout = 120,
		.min_lease_timeout = 60,
		.initial_backoff = 10,
	};
}

int farm_config_check(const struct farm_config *c, struct error *e)
{
	if (c->first_job_id == 0 || c->max_jobs == 0 || c->max_ended_jobs == 0 || c->max_peers == 0 ||
	    c->max_peer_leases == 0 || c->max_faults == 0)
		return error_set(e, EINVAL, "a farm without jobs, workers or leases");
	if (!(c->silence_timeout > 0 && c->disconnect_timeout >= c->silence_timeout && c->default_lease_timeout > 0 &&
	      c->min_lease_timeout > 0 && c->default_copy_delay > 0 && c->copy_timeout > 0 && c->initial_backoff > 0))
		return error_set(e, EINVAL, "the farm's times are not in order");
	return 0;
}
