/* SPDX-License-Identifier: Apache-2.0 */
/* A slot is one (group, part) of a job: a chain of leases of which exactly one is next, and the holders of that
 * lease. */
#ifndef COORDINATOR_CORE_SLOT_H
#define COORDINATOR_CORE_SLOT_H

#include "common/film/batch.h"
#include "coordinator/core/list.h"

struct identity;
struct job;
struct peer;
struct slot;

/* One worker's hold on one open lease. Stored in its worker's table and linked to its slot. */
struct lease {
	bool used;
	bool overdue;	/* timed out: no longer counts as held */
	bool delivered; /* its result is received but not judged yet: no longer counts as work to do */
	struct peer *peer;
	struct job *job;
	struct slot *slot; /* its key is that of the slot's next epoch: merging ends all leases of the slot */
	double sent, deadline;
	struct lease *next; /* of the same slot */
};

/* See failure_quorum.h. */
enum { FAILURE_QUORUM_FATAL = 3 };

struct failure_quorum {
	uint32_t count;
	struct {
		uint64_t who, certificate; /* ids of struct identity */
	} of[FAILURE_QUORUM_FATAL];
};

/* See doubt.h. */
struct doubt {
	uint64_t maker;	  /* the worker that made the states of the next epoch; 0: not known */
	uint64_t before;  /* the maker of the states that that worker started from; 0: not known */
	uint64_t refuser; /* the first that refused them; 0: nobody */
	uint64_t barred;  /* the maker whose epoch is computed again; 0: none */
	uint64_t reach;	  /* number of epochs taken back here */
	uint32_t again;	  /* epochs merged since */
	bool anew;	  /* its chains start the next epoch from their seeds */
};

/* See lost_holders.h. */
enum { LOST_FATAL = 8 };

struct lost_holders {
	uint32_t count;
	struct lost_worker {
		const struct identity *who;	 /* valid as long as its id is this one */
		uint64_t id, certificate, calls; /* calls: its number of connections at that time */
	} of[LOST_FATAL];
};

struct slot {
	struct link link;     /* in one of the job's lists, or in none: two holders, or nothing left to do */
	struct lease *leases; /* including overdue ones */
	uint64_t next;	      /* the first epoch that is not merged */
	double since;	      /* when the current lease was sent */
	struct failure_quorum failure_quorum; /* at the next epoch */
	struct lost_holders lost;	      /* while they held it */
	struct doubt doubt;		      /* about the states that it starts from */
	uint32_t holders, timeouts;
};

/* Another worker has been asked about the states. */
static inline bool doubt_waits(const struct slot *s)
{
	return s->doubt.refuser && !s->doubt.anew;
}

#endif
