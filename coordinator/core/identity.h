/* SPDX-License-Identifier: Apache-2.0 */
/* A worker, whatever its connections (worker_registry.h). */
#ifndef COORDINATOR_CORE_IDENTITY_H
#define COORDINATOR_CORE_IDENTITY_H

#include "coordinator/core/event.h"

enum {
	IDENTITY_AVOIDED = 8,
	IDENTITY_QUARANTINED = 64,
	IDENTITY_CERTIFICATE = 72,
	IDENTITY_NAME = JOIN_NAME,
	IDENTITY_HOME = JOIN_HOME
};

enum { PEER_WINDOW = 8 /* leases that a new worker may hold */ };

/* After a failed lease the worker pauses with that job for a while. */
struct backoff {
	uint64_t job; /* 0: free */
	uint32_t failures;
	double until;
	bool own;   /* each failure since the last pause was its own machine's fault */
	bool later; /* it did not fail: its memory has room for one scene and holds another */
	bool held;  /* with later: it held leases then. When it has none any more, the pause ends at once */
};

enum identity_key { IDENTITY_BY_ID, IDENTITY_BY_HOME, IDENTITY_BY_NAME, IDENTITY_KEYS };

struct identity {
	struct identity *next[IDENTITY_KEYS]; /* identity_index.h */
	uint32_t place;			      /* its index among those that are known */
	uint64_t id;			      /* never used twice */
	uint64_t certificate_id;	      /* equal for all with the same certificate */
	char certificate[IDENTITY_CERTIFICATE], name[IDENTITY_NAME], home[IDENTITY_HOME];
	uint64_t restarts; /* restarts of the home, as last reported */
	uint64_t calls;	   /* connections so far, and how often it came back after silence */
	uint32_t uses;	   /* references: connections, and answers that wait for a second one */
	uint32_t faults_in_row, wrong;
	uint32_t window; /* leases that it may hold: see peer_succeeded */
	bool quarantined;
	double seen;
	double full_until; /* its memory is full: till then it gets only leases of jobs of which it holds some */
	bool full_held;	   /* it held leases then: when it has none any more, full_until counts no longer */
	struct backoff avoid[IDENTITY_AVOIDED];
	char text[256]; /* its last fault */
};

/* See identity_index.h. */
struct identity_index {
	struct identity **first[IDENTITY_KEYS];
	uint32_t buckets;
};

#endif
