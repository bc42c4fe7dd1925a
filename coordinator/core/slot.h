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
	bool is_in_use;
	bool is_overdue;   /* timed out: no longer counts as held, but an answer still counts */
	bool is_delivered; /* its result has arrived but is not judged yet: no longer counts as work to do */
	struct peer *peer;
	struct job *job;
	/* The lease is for the slot's next epoch, so merging that epoch ends all leases of the slot. */
	struct slot *slot;
	double sent_at, deadline;
	struct lease *next; /* next lease of the same slot */
};

/* The workers that failed with a lease or job; see failure_quorum.h. */
enum { FAILURE_QUORUM_SIZE = 3 };

struct failure_quorum {
	uint32_t count;
	struct {
		uint64_t identity_id, certificate_id; /* `id` and `certificate_id` of struct identity */
	} workers[FAILURE_QUORUM_SIZE];
};

/* Who made and who refused the chain states that the slot's next epoch starts from; see doubt.h. */
struct doubt {
	uint64_t maker;		     /* worker that made the states; 0: not known */
	uint64_t previous_maker;     /* worker that made the states one epoch earlier; 0: not known */
	uint64_t refuser;	     /* first worker that refused the states; 0: none */
	uint64_t barred_maker;	     /* maker of an epoch that was taken back and is computed again; 0: none */
	uint64_t rollback_watermark; /* highest `next_epoch` from which an epoch was taken back; 0: none, or passed
					since */
	uint32_t rollback_count;     /* epochs taken back since the slot last got beyond `rollback_watermark` */
	bool starts_from_seeds;	     /* its chains start the next epoch from their seeds */
};

/* Workers that were lost while they held the slot's next lease; see lost_holders.h. */
enum { LOST_HOLDERS_FATAL = 8 };

struct lost_holders {
	uint32_t count;
	struct lost_worker {
		const struct identity *identity; /* valid only while identity->id equals id */
		/* contact_count: identity->contact_count when the worker was lost */
		uint64_t id, certificate_id, contact_count;
	} workers[LOST_HOLDERS_FATAL];
};

struct slot {
	struct link link;	    /* in one of the job's lists; in none with two holders or after the last epoch */
	struct lease *leases;	    /* all leases for the next epoch, including overdue ones */
	uint64_t next_epoch;	    /* first epoch that is not merged */
	double last_holder_sent_at; /* when the lease of the remaining holder was sent */
	struct failure_quorum failure_quorum; /* workers that failed with the next epoch */
	struct lost_holders lost_holders;     /* workers that were lost while they held the next epoch */
	struct doubt doubt;		      /* about the states that the next epoch starts from */
	uint32_t holder_count, timeout_count;
};

/* Whether a worker has refused the states and another one is asked about them. */
static inline bool doubt_is_pending(const struct slot *s)
{
	return s->doubt.refuser && !s->doubt.starts_from_seeds;
}

#endif
