/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/server/limits.h"

#include "common/base/log.h"
#include "coordinator/core/farm.h"

#include <string.h>
#include <sys/resource.h>

enum {
	OF_JOB = 3,  /* descriptors per job: log, journal, the next journal during a checkpoint */
	SPARE = 128, /* for the spool and database, incoming files, readers of the status */
	OTHERS = FARM_JOBS * OF_JOB + FETCHES_MOST + SPARE,
	FEWEST = 16, /* the fewest connections with which a coordinator is of use */
};

int limits_connections(unsigned asked, unsigned *connections, struct error *e)
{
	struct rlimit r;
	if (getrlimit(RLIMIT_NOFILE, &r))
		return error_set(e, errno, "the limit of file descriptors: %s", strerror(errno));
	rlim_t want = (rlim_t)(asked ? asked : CONNECTIONS_DEFAULT) + OTHERS, before = r.rlim_cur;
	if (r.rlim_cur < want) {
		r.rlim_cur = r.rlim_max < want ? r.rlim_max : want;
		if (setrlimit(RLIMIT_NOFILE, &r))
			return error_set(e, errno, "the limit of file descriptors: %s", strerror(errno));
	}
	rlim_t room = r.rlim_cur > OTHERS ? r.rlim_cur - OTHERS : 0;
	unsigned least = asked ? asked : FEWEST;
	if (least > room)
		return error_set(
			e, EINVAL,
			"%u connections, and %d jobs, need %u file descriptors, and this process may have %llu (ulimit -Hn, LimitNOFILE)",
			least, FARM_JOBS, least + OTHERS, (unsigned long long)r.rlim_cur);
	*connections = want - OTHERS < room ? (unsigned)(want - OTHERS) : (unsigned)room;
	log_event(LOG_LIMITS, "connections=%u descriptors=%llu before=%llu", *connections,
		  (unsigned long long)r.rlim_cur, (unsigned long long)before);
	return 0;
}
