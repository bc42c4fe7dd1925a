/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Who workers are, for longer than their connections last: what a worker did wrong is not forgotten when it calls
 * again. A worker is known by the name in its certificate ("" without TLS) together with the name that it gives itself
 * or its home, the folder that counts its starts: who has one of the two in common with somebody is that somebody.
 * Bounded: those who have been away longest are forgotten first, of the newcomer's own certificate before others, and
 * those that are set aside last; of these IDENTITY_QUARANTINED a certificate, so that one that makes up names pushes
 * out none but its own. Allocates when a worker joins.
 */
#ifndef COORDINATOR_CORE_WORKER_REGISTRY_H
#define COORDINATOR_CORE_WORKER_REGISTRY_H

#include "coordinator/core/farm.h"

enum {
	IDENTITY_AVOIDED = 8,
	IDENTITY_QUARANTINED = 64,
	IDENTITY_CERTIFICATE = 72,
	IDENTITY_NAME = JOIN_NAME,
	IDENTITY_HOME = JOIN_HOME
};

/* After a failed lease the worker stays away from that job for a while. */
struct avoid {
	uint64_t job; /* 0: free */
	uint32_t failures;
	double until;
	bool own; /* each of its failures since the last pause was its own machine's */
};

struct identity {
	uint64_t id;		 /* never used twice */
	uint64_t certificate_id; /* the same for all of one certificate */
	char certificate[IDENTITY_CERTIFICATE], name[IDENTITY_NAME], home[IDENTITY_HOME];
	uint64_t restarts; /* of the home, as they were last told */
	uint64_t calls;	   /* connections so far, and how often it was heard again after a silence */
	uint32_t uses;	   /* connections, and answers that wait for a second one */
	uint32_t faults_in_row, wrong;
	uint32_t window; /* leases that it may hold: see peer_widen */
	bool aside;
	double seen;
	struct avoid avoid[IDENTITY_AVOIDED];
	char text[256]; /* its last fault */
};

/* As they were last told when there is one like that, else a new one; used by the caller. NULL with a sentence:
 * refused. */
struct identity *worker_registry_use(struct farm *f, const struct event_join *e, const char **refused);
void worker_registry_drop(struct farm *f, struct identity *who);
void worker_registry_free(struct farm *f);

/* The connections of an earlier life of the same home are closed. false with a sentence: this one is of an earlier
 * life. */
bool worker_registry_replace(struct farm *f, const struct event_join *e, const char **refused);

/* Counted as a wrong result; what it was in a few words. */
void worker_registry_wrong(struct farm *f, struct identity *who, const char *what, const struct lease_key *k);
/* For good: no leases, nothing that it sends counts. */
void worker_registry_quarantine(struct farm *f, struct identity *who);

/* As it was in an earlier life of the coordinator. */
void worker_registry_restore_quarantined(struct farm *f, const struct event_join *e, const char *text);

#endif
