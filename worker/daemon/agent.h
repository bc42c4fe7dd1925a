/*
 * The worker daemon: one loop thread that owns all state, a crew of render threads. Connects, asks for leases, fetches
 * what it needs, sends results and keeps them until they are acknowledged; reconnects for ever. On SIGTERM it finishes
 * what runs within the grace period, or gives it up, and leaves. Tells the service manager what it waits to hear
 * (common/net/notify.h).
 */
#ifndef WORKER_DAEMON_AGENT_H
#define WORKER_DAEMON_AGENT_H

#include "common/base/error.h"

#include <stdbool.h>
#include <stdint.h>

struct agent_config {
	const char *coordinator, *name;
	const char *tls;   /* a folder (common/net/tls.h); NULL or "": plaintext */
	const char *cache; /* NULL: the user's cache folder */
	uint64_t cache_bytes;
	unsigned threads;
	double grace_seconds;
	double idle_seconds; /* without a lease for so long: it leaves; 0: never */
	bool insecure;
	unsigned lie; /* tests: one of so many results has a wrong bit; 0: none */
	bool repeat; /* tests: every result is sent twice */
};

/* Returns when the worker has left. -EINVAL, -EPERM, -EHOSTUNREACH at once when the address is of no use. */
int agent_run(const struct agent_config *c, struct error *e);

#endif
