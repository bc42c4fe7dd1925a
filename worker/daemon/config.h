/* SPDX-License-Identifier: Apache-2.0 */
/* The options of hslt-worker. */
#ifndef WORKER_DAEMON_CONFIG_H
#define WORKER_DAEMON_CONFIG_H

#include <stdbool.h>
#include <stdint.h>

struct agent_config {
	const char *coordinator_address, *name;
	const char *tls_folder;	  /* a folder (common/net/tls.h); NULL or "": plaintext */
	const char *cache_folder; /* NULL: the user's cache folder */
	uint64_t max_cache_bytes;
	unsigned threads;
	double grace_seconds;
	double idle_seconds;  /* the worker exits after this time without a lease; 0: never */
	double stall_seconds; /* a lease or build without progress for this time counts as hung; 0: not checked */
	bool insecure;
};

#endif
