/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/server/limits.h"

#include "common/base/log.h"
#include "coordinator/core/farm.h"

#include <string.h>
#include <sys/resource.h>

enum {
	DESCRIPTORS_PER_JOB = 3, /* descriptors per job: log, journal, the next journal during a checkpoint */
	SPARE_DESCRIPTORS = 128, /* for the spool and database, incoming files, readers of the status */
	OTHER_DESCRIPTORS = FARM_JOBS_DEFAULT * DESCRIPTORS_PER_JOB + FETCHES_MAX + SPARE_DESCRIPTORS,
	CONNECTIONS_MIN = 16, /* the fewest connections with which a coordinator is of use */
};

int limits_reserve_connections(unsigned requested, unsigned *connections, struct error *e)
{
	struct rlimit r;
	if (getrlimit(RLIMIT_NOFILE, &r))
		return error_set(e, errno, "the limit of file descriptors: %s", strerror(errno));
	rlim_t wanted = (rlim_t)(requested ? requested : CONNECTIONS_DEFAULT) + OTHER_DESCRIPTORS, before = r.rlim_cur;
	if (r.rlim_cur < wanted) {
		r.rlim_cur = r.rlim_max < wanted ? r.rlim_max : wanted;
		if (setrlimit(RLIMIT_NOFILE, &r))
			return error_set(e, errno, "the limit of file descriptors: %s", strerror(errno));
	}
	rlim_t available = r.rlim_cur > OTHER_DESCRIPTORS ? r.rlim_cur - OTHER_DESCRIPTORS : 0;
	unsigned required = requested ? requested : CONNECTIONS_MIN;
	if (required > available)
		return error_set(
			e, EINVAL,
			"%u connections, and %d jobs, need %u file descriptors, and this process may have %llu (ulimit -Hn, LimitNOFILE)",
			required, FARM_JOBS_DEFAULT, required + OTHER_DESCRIPTORS, (unsigned long long)r.rlim_cur);
	*connections =
		wanted - OTHER_DESCRIPTORS < available ? (unsigned)(wanted - OTHER_DESCRIPTORS) : (unsigned)available;
	log_event(LOG_LIMITS, "connections=%u descriptors=%llu before=%llu", *connections,
		  (unsigned long long)r.rlim_cur, (unsigned long long)before);
	return 0;
}
