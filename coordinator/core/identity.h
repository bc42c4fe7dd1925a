/* SPDX-License-Identifier: Apache-2.0 */
/* What the core remembers of a worker across its connections (worker_registry.h). */
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

enum { PEER_WINDOW = 8 /* limit on the leases of a worker that has not returned a result yet */ };

/* The pause of a worker with a job after a failed lease. */
struct backoff {
	uint64_t job; /* 0: this entry is free */
	uint32_t failures;
	double until;
	bool own;   /* all failures since the last pause were faults of the worker's own machine */
	bool later; /* no failure: its memory has room for one scene and holds another one */
	bool held;  /* with later: it held leases at that time. Once it holds none, the pause ends at once */
};

enum identity_key { IDENTITY_BY_ID, IDENTITY_BY_HOME, IDENTITY_BY_NAME, IDENTITY_KEYS };

struct identity {
	struct identity *next[IDENTITY_KEYS]; /* identity_index.h */
	uint32_t place;			      /* its index in farm.known */
	uint64_t id;			      /* never reused */
	uint64_t certificate_id;	      /* equal for all workers with the same certificate */
	char certificate[IDENTITY_CERTIFICATE], name[IDENTITY_NAME], home[IDENTITY_HOME];
	uint64_t restarts; /* number of starts of the home, as last reported */
	uint64_t calls;	   /* connections so far, plus the number of times it was heard again after silence */
	uint32_t uses;	   /* references: connections, and noted answers of verified leases */
	uint32_t faults_in_row, wrong;
	uint32_t window; /* leases that it may hold (see peer_succeeded) */
	bool quarantined;
	double seen;
	/* Its memory is full; until this time it gets only leases of jobs of which it already holds some. */
	double full_until;
	bool full_held; /* it held leases at that time; once it holds none, full_until no longer applies */
	struct backoff avoid[IDENTITY_AVOIDED];
	char text[256]; /* describes its last fault */
};

/* See identity_index.h. */
struct identity_index {
	struct identity **first[IDENTITY_KEYS];
	uint32_t buckets;
};

#endif
