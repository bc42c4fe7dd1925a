/* SPDX-License-Identifier: Apache-2.0 */
/* What a worker is started with: the options of hslt-worker. */
#ifndef WORKER_DAEMON_CONFIG_H
#define WORKER_DAEMON_CONFIG_H

#include <stdbool.h>
#include <stdint.h>

struct agent_config {
	const char *coordinator, *name;
	const char *tls;   /* a folder (common/net/tls.h); NULL or "": plaintext */
	const char *cache; /* NULL: the user's cache folder */
	uint64_t cache_bytes;
	unsigned threads;
	double grace_seconds;
	double idle_seconds;  /* without a lease for so long: it leaves; 0: never */
	double stall_seconds; /* a lease or a building that makes no progress for so long hangs; 0: nobody looks */
	bool insecure;
};

#endif
