/* SPDX-License-Identifier: Apache-2.0 */
/* A slot is one (group, part) of a job: a chain of leases of which exactly one is next, and the workers that hold
 * that lease. */
#ifndef COORDINATOR_CORE_SLOT_H
#define COORDINATOR_CORE_SLOT_H

#include "common/film/batch.h"
#include "coordinator/core/list.h"

struct identity;
struct job;
struct peer;
struct slot;

/* A lease held by one worker. Stored in the worker's table and linked to the slot. */
struct lease {
	bool used;
	bool overdue;	/* timed out: no longer counts as held, but an answer still counts */
	bool delivered; /* its result has arrived but is not judged yet: no longer counts as work to do */
	struct peer *peer;
	struct job *job;
	/* The lease is for the slot's next epoch, so merging that epoch ends all leases of the slot. */
	struct slot *slot;
	double sent, deadline;
	struct lease *next; /* next lease of the same slot */
};

/* The workers that failed with a lease or job; see failure_quorum.h. */
enum { FAILURE_QUORUM_FATAL = 3 };

struct failure_quorum {
	uint32_t count;
	struct {
		uint64_t who, certificate; /* numbers in struct identity: id, certificate_id */
	} of[FAILURE_QUORUM_FATAL];
};

/* Who made and who refused the chain states that the slot's next epoch starts from; see doubt.h. */
struct doubt {
	uint64_t maker;	  /* worker that made the states; 0: not known */
	uint64_t before;  /* worker that made the states one epoch earlier; 0: not known */
	uint64_t refuser; /* first worker that refused the states; 0: none */
	uint64_t barred;  /* maker of an epoch that was taken back and is computed again; 0: none */
	uint64_t reach;	  /* highest `next` from which an epoch was taken back; 0: none, or passed since */
	uint32_t again;	  /* epochs taken back since the slot last got beyond `reach` */
	bool anew;	  /* its chains start the next epoch from their seeds */
};

/* Workers that were lost while they held the slot's next lease; see lost_holders.h. */
enum { LOST_FATAL = 8 };

struct lost_holders {
	uint32_t count;
	struct lost_worker {
		const struct identity *who;	 /* valid only while who->id equals id */
		uint64_t id, certificate, calls; /* calls: who->calls when the worker was lost */
	} of[LOST_FATAL];
};

struct slot {
	struct link link;     /* in one of the job's lists; in none with two holders or after the last epoch */
	struct lease *leases; /* all leases for the next epoch, including overdue ones */
	uint64_t next;	      /* first epoch that is not merged */
	double since;	      /* when the lease of the remaining holder was sent */
	struct failure_quorum failure_quorum; /* workers that failed with the next epoch */
	struct lost_holders lost;	      /* workers that were lost while they held the next epoch */
	struct doubt doubt;		      /* about the states that the next epoch starts from */
	uint32_t holders, timeouts;
};

/* Whether a worker has refused the states and another one is asked about them. */
static inline bool doubt_waits(const struct slot *s)
{
	return s->doubt.refuser && !s->doubt.anew;
}

#endif
