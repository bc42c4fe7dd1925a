/* SPDX-License-Identifier: Apache-2.0 */
/* A worker as the core sees it. Waiting workers queue by fingerprint, the one that has waited longest first. */
#ifndef COORDINATOR_CORE_PEER_H
#define COORDINATOR_CORE_PEER_H

#include "coordinator/core/farm.h"
#include "coordinator/core/lease.h"
#include "coordinator/core/list.h"
#include "coordinator/core/worker_registry.h"

enum { PEER_WINDOW = 8 /* leases that a worker may hold before it has given anything */ };
enum { PEER_NAME = IDENTITY_NAME, FINGERPRINT_SIZE = 128 };

/* Workers with the same numeric fingerprint. */
struct peer_class {
	struct link link;    /* farm.classes */
	struct link waiting; /* peers that have a wish */
	uint32_t uses;	     /* workers and live jobs */
	uint32_t active;     /* workers that may get leases */
	char fingerprint[FINGERPRINT_SIZE];
};

struct peer {
	uint64_t id;
	char name[PEER_NAME];
	struct identity *who;
	char home[IDENTITY_HOME];
	uint64_t restarts;
	struct peer_class *class;
	uint32_t threads, want;
	uint32_t held; /* leases that are neither overdue nor delivered */
	uint32_t delivered;
	enum peer_state state;
	struct link waiting;
	uint64_t queued; /* when it began to wait, as a number */
	double joined, heard;
	bool returns; /* it has called again, and this connection goes */
	uint64_t merged, repeats, refused, faults, failures, timeouts;
	char text[256];
	uint32_t lease_limit;
	struct lease leases[];
};

struct peer_class *peer_class_use(struct farm *f, const char *fingerprint); /* NULL: no memory */
void peer_class_drop(struct peer_class *c);

/* NULL with a sentence when it is refused. */
struct peer *peer_join(struct farm *f, const struct event_join *e, const char **refused);
void peer_leave(struct farm *f, struct peer *p);
/* The same of one that has gone by itself; its leases count as lost by it. */
void peer_lose(struct farm *f, struct peer *p);
void peer_lose_leases(struct farm *f, struct peer *p);
void peer_set_state(struct farm *f, struct peer *p, enum peer_state s);
void peer_heard(struct farm *f, struct peer *p);
void peer_drop_leases(struct farm *f, struct peer *p, bool revoke);
/* Queues it or takes it out of the queue after its wish, leases or state changed; at the end of the queue if queued. */
void peer_requeue(struct farm *f, struct peer *p);
bool peer_has_wish(const struct peer *p);

void peer_fault(struct farm *f, struct peer *p, const char *text);
void peer_failed(const struct farm *f, struct peer *p, uint64_t job, bool own);
void peer_succeeded(struct farm *f, struct peer *p, uint64_t job);
void peer_was_late(struct farm *f, struct peer *p);	      /* with a lease that others get now, or have answered */
double peer_avoids_until(const struct peer *p, uint64_t job); /* -INFINITY: does not */
bool peer_lacks(const struct peer *p, uint64_t job);	      /* its last failure with the job was its own machine's */

#endif
