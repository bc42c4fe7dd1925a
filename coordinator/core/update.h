/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What the caller has to do after a step of the core (farm.h): a list of actions, to be carried out in their order.
 * The list and its texts belong to the core and are valid until the next farm_step.
 */
#ifndef COORDINATOR_CORE_UPDATE_H
#define COORDINATOR_CORE_UPDATE_H

#include "common/film/batch.h"

#include <stdbool.h>
#include <stddef.h>

enum job_state { JOB_QUEUED, JOB_BOOTSTRAP, JOB_RUNNING, JOB_HELD, JOB_DONE, JOB_FAILED, JOB_CANCELLED };

/* It has ended. */
static inline bool job_state_is_end(enum job_state s)
{
	return s == JOB_DONE || s == JOB_FAILED || s == JOB_CANCELLED;
}

enum peer_state { PEER_ACTIVE, PEER_SILENT, PEER_QUARANTINED };

/* Why a job ended. */
enum job_end {
	END_NONE,
	END_MUTATIONS, /* all rounds of the plan */
	END_TIME,
	END_ERROR, /* the target error was reached */
	END_BLACK, /* no bootstrap sample carried light: the image is black */
	END_CANCELLED,
	END_FAILED,
};

/* See farm_awaits (status.h). */
enum farm_delivery { DELIVERY_AWAITED, DELIVERY_OPEN, DELIVERY_USELESS };

enum action_kind {
	ACTION_SUBMITTED, /* tag, job: the new job's id */
	ACTION_CANCELLED, /* tag, job */
	ACTION_REJECTED,  /* tag, text: SUBMIT or CANCEL was refused. tag 0, peer, text: JOINED was refused, hang up */
	/* peer, key. For render leases with epoch > 0 of PLAN_CHAINS add the chain states of the merged batch of epoch
	 * - 1; with epoch 0 the seeds. The shell keeps one set of states per (job, group, part): that of the last
	 * merge. */
	ACTION_SEND_LEASE,
	ACTION_REVOKE, /* peer, key: the worker may drop it; an answer that comes all the same is handled */
	/* The batch of this event, now, exactly once; comes before everything that depends on it. */
	ACTION_MERGE, /* peer, key */
	ACTION_ACK,   /* peer, key, ack, text: answer to the batch of this event */
	/* job: every bootstrap batch is merged. Make b, seeds, canvas and answer with EVENT_PREPARED, at once or later.
	 */
	ACTION_BOOTSTRAP_DONE,
	ACTION_ROUND_DONE, /* job, rounds: complete rounds, now that this event's batch is merged */
	/* job, rounds: answer with EVENT_ERROR_KNOWN for exactly this prefix. Later batches of the job should wait for
	 * the answer; one that would complete the next round before it is refused, so the prefix stays what was asked
	 * for. */
	ACTION_EVALUATE_ERROR,
	ACTION_PUBLISH,	      /* job, rounds: write the image of the prefix; the job is done */
	ACTION_JOB_CHANGED,   /* job, state, end, text */
	ACTION_JOB_FORGOTTEN, /* job: too many ended jobs; the core answers no more questions about it */
	/* who, job, key, text: the batch of this lease, the last of its (group, part), is taken out of the films, and
	 * the states before it are the last ones again; its lease goes out once more. Only where the event says that
	 * the caller can. */
	ACTION_TAKE_BACK,
	ACTION_CHAINS_ANEW, /* job, key, text: the chains of this lease begin from their seeds (doubt.h) */
	ACTION_WRONG,	    /* who, job, key, text: a worker's answer, noted before, is not what two others say */
	ACTION_QUARANTINE,  /* who, text: a worker is quarantined permanently */
	ACTION_CLOSE_PEER,  /* peer, text: hang up; the core has forgotten it already */
};

enum ack { ACK_MERGED, ACK_REPEAT, ACK_REFUSED, ACK_NOTED };

struct action {
	enum action_kind kind;
	enum ack ack;
	enum job_state state;
	enum job_end end;
	bool verified; /* MERGE: two workers agree */
	bool anew;     /* SEND_LEASE: with seeds whatever its epoch */
	uint64_t tag, peer;
	uint64_t who; /* of MERGE, TAKE_BACK (0: not known), WRONG, QUARANTINE: the worker, whatever its connection
			 (struct peer_status) */
	uint64_t job; /* also of actions with a key */
	uint64_t rounds;
	struct lease_key key;
	const char *text; /* never NULL; may be "" */
};

struct update {
	const struct action *actions;
	size_t count;
	double wake; /* give EVENT_TICK at this time unless another event comes first; INFINITY: no need */
};

#endif
