/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/config.h"

void farm_config_init(struct farm_config *c)
{
	*c = (struct farm_config){
		.first_job = 1,
		.max_jobs = FARM_JOBS,
		.max_ended = 1000,
		.max_peers = 4096,
		.max_peer_leases = 256,
		.max_slots = 1 << 16,
		.max_faults = 3,
		.silent_after = 30,
		.forget_after = 300,
		.first_timeout = 600,
		.first_copy = 30,
		.idle_timeout = 120,
		.min_timeout = 60,
		.first_pause = 10,
	};
}

int farm_config_check(const struct farm_config *c, struct error *e)
{
	if (c->first_job == 0 || c->max_jobs == 0 || c->max_ended == 0 || c->max_peers == 0 ||
	    c->max_peer_leases == 0 || c->max_faults == 0)
		return error_set(e, EINVAL, "a farm without jobs, workers or leases");
	if (!(c->silent_after > 0 && c->forget_after >= c->silent_after && c->first_timeout > 0 && c->min_timeout > 0 &&
	      c->first_copy > 0 && c->idle_timeout > 0 && c->first_pause > 0))
		return error_set(e, EINVAL, "the farm's times are not in order");
	return 0;
}
