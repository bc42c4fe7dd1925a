#include "coordinator/shell/limits.h"

#include "common/base/log.h"

#include <string.h>
#include <sys/resource.h>

enum { OTHERS = 256 /* descriptors: journals, logs and films of jobs, the spool's, whoever looks at the status */ };

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
	rlim_t room = r.rlim_cur > OTHERS ? r.rlim_cur - OTHERS : 1;
	if (asked > room)
		return error_set(e, EINVAL, "%u connections need %u file descriptors, and this process may have %llu (ulimit -Hn, LimitNOFILE)",
				 asked, asked + OTHERS, (unsigned long long)r.rlim_cur);
	*connections = want - OTHERS < room ? (unsigned)(want - OTHERS) : (unsigned)room;
	log_event(LOG_LIMITS, "connections=%u descriptors=%llu before=%llu", *connections, (unsigned long long)r.rlim_cur,
		  (unsigned long long)before);
	return 0;
}
