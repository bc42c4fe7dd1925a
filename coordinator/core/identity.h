/* SPDX-License-Identifier: Apache-2.0 */
/* What the core remembers of a worker across its connections (worker_registry.h). */
#ifndef COORDINATOR_CORE_IDENTITY_H
#define COORDINATOR_CORE_IDENTITY_H

#include "coordinator/core/event.h"

enum {
	IDENTITY_BACKOFFS_MAX = 8,
	IDENTITY_QUARANTINED_MAX = 64,
	IDENTITY_CERTIFICATE_SIZE = 72,
	IDENTITY_NAME_SIZE = JOIN_NAME_SIZE,
	IDENTITY_HOME_SIZE = JOIN_HOME_SIZE
};

enum { PEER_INITIAL_WINDOW = 8 /* limit on the leases of a worker that has not returned a result yet */ };

/* The pause of a worker with a job after a failed lease. */
struct backoff {
	uint64_t job; /* 0: this entry is free */
	uint32_t failures;
	double until;
	bool is_worker_at_fault; /* all failures since the last pause were faults of the worker's own machine */
	bool is_memory_full;	 /* no failure: its memory has room for one scene and holds another one */
	/* with is_memory_full: it held leases at that time. Once it holds none, the pause ends at once */
	bool had_leases;
};

enum identity_key { IDENTITY_BY_ID, IDENTITY_BY_HOME, IDENTITY_BY_NAME, IDENTITY_KEY_COUNT };

struct identity {
	struct identity *next[IDENTITY_KEY_COUNT]; /* identity_index.h */
	uint32_t registry_index;		   /* its index in farm.registry */
	uint64_t id;				   /* never reused */
	uint64_t certificate_id;		   /* equal for all workers with the same certificate */
	char certificate[IDENTITY_CERTIFICATE_SIZE], name[IDENTITY_NAME_SIZE], home[IDENTITY_HOME_SIZE];
	uint64_t restarts;	  /* number of starts of the home, as last reported */
	uint64_t contact_count;	  /* connections so far, plus the number of times it was heard again after silence */
	uint32_t reference_count; /* references: connections, and noted answers of verified leases */
	uint32_t consecutive_faults, wrong_results;
	uint32_t lease_window; /* leases that it may hold (see peer_note_success) */
	bool is_quarantined;
	double last_seen;
	/* Its memory is full; until this time it gets only leases of jobs of which it already holds some. */
	double memory_full_until;
	bool had_leases_when_full; /* it held leases at that time; once it holds none, memory_full_until no longer
				       applies */
	struct backoff backoffs[IDENTITY_BACKOFFS_MAX];
	char last_fault[256]; /* describes its last fault */
};

/* See identity_index.h. */
struct identity_index {
	struct identity **bucket_heads[IDENTITY_KEY_COUNT];
	uint32_t bucket_count;
};

#endif
