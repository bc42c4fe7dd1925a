/* SPDX-License-Identifier: Apache-2.0 */
/* A slot is one (group, part) of a job: the chain of leases of which exactly one is next; and the leases on it. */
#ifndef COORDINATOR_CORE_SLOT_H
#define COORDINATOR_CORE_SLOT_H

#include "common/film/batch.h"
#include "coordinator/core/list.h"

struct identity;
struct job;
struct peer;
struct slot;

/* One worker's hold on one open lease. Lives in its worker's table; linked to its slot. */
struct lease {
	bool used;
	bool overdue;	/* counts no longer as held: handed out again */
	bool delivered; /* its result waits to be looked at: counts no longer among what its worker has to do */
	struct peer *peer;
	struct job *job;
	struct slot *slot; /* the key is that of the slot's next epoch: a merge ends all leases of the slot */
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
	uint64_t maker;	  /* the worker whose states the next epoch begins with; 0: not known */
	uint64_t before;  /* the one whose states that worker began with; 0: not known */
	uint64_t refuser; /* the first that could not read them; 0: nobody */
	uint64_t barred;  /* whose epoch is computed again; 0: nobody's */
	uint64_t reach;	  /* epochs were taken back from here */
	uint32_t again;	  /* so many since then */
	bool anew;	  /* its chains begin the next epoch from their seeds */
};

/* See lost.h. */
enum { LOST_FATAL = 8 };

struct lost {
	uint32_t count;
	struct lost_worker {
		const struct identity *who;	 /* as long as its id is this one */
		uint64_t id, certificate, calls; /* calls: how often it had called then */
	} of[LOST_FATAL];
};

struct slot {
	struct link link;		      /* one of the job's lists, or alone: two holders, or nothing left to do */
	struct lease *leases;		      /* overdue ones too */
	uint64_t next;			      /* the first epoch that is not merged */
	double since;			      /* when the lease that is out was sent */
	struct failure_quorum failure_quorum; /* with the next epoch */
	struct lost lost;		      /* while they held it */
	struct doubt doubt;		      /* about the states with which it begins */
	uint32_t holders, timeouts;
};

/* Somebody else is asked about the states. */
static inline bool doubt_waits(const struct slot *s)
{
	return s->doubt.refuser && !s->doubt.anew;
}

#endif
