/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What the caller has to do after a step of the core (farm.h): a list of actions, to be carried out in order. The list
 * and its texts belong to the core and are valid until the next farm_step.
 */
#ifndef COORDINATOR_CORE_UPDATE_H
#define COORDINATOR_CORE_UPDATE_H

#include "common/film/batch.h"

#include <stdbool.h>
#include <stddef.h>

enum job_state { JOB_QUEUED, JOB_BOOTSTRAP, JOB_RUNNING, JOB_HELD, JOB_DONE, JOB_FAILED, JOB_CANCELLED };

/* Whether it has ended. */
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
	END_BLACK, /* no sample (of chains, of the bootstrap) carried light: the image is black */
	END_CANCELLED,
	END_FAILED,
};

/* See answer_awaits (answer.h). */
enum farm_delivery { DELIVERY_AWAITED, DELIVERY_OPEN, DELIVERY_USELESS };

enum action_kind {
	ACTION_SUBMITTED, /* tag, job: the new job's id */
	ACTION_CANCELLED, /* tag, job */
	ACTION_REJECTED,  /* tag, text: SUBMIT or CANCEL was refused. tag 0, peer, text: JOINED was refused; disconnect
			   */
	/* peer, key. For render leases with epoch > 0 of PLAN_CHAINS, send the chain states of the merged batch of
	 * epoch - 1; with epoch 0, the seeds. The shell keeps one set of states per (job, group, part): that of the
	 * last merge. */
	ACTION_SEND_LEASE,
	ACTION_REVOKE, /* peer, key: the worker may drop it; an answer that still comes is handled */
	/* Merge this event's batch now, exactly once; comes before all actions that depend on it. */
	ACTION_MERGE, /* peer, key */
	ACTION_ACK,   /* peer, key, ack, text: the answer to this event's batch */
	/* job: the bootstrap is complete. Make b, seeds and canvas, and answer with EVENT_PREPARED, at once or
	 * later. */
	ACTION_BOOTSTRAP_DONE,
	ACTION_ROUND_DONE, /* job, rounds: complete rounds, including this event's batch */
	/* job, rounds: answer with EVENT_ERROR_KNOWN for exactly this prefix. Later batches of the job should wait
	 * for the answer; one that would complete the next round before it is refused, so the prefix does not
	 * change. */
	ACTION_EVALUATE_ERROR,
	ACTION_PUBLISH,	      /* job, rounds: write the image of the prefix; the job is done */
	ACTION_JOB_CHANGED,   /* job, state, end, text */
	ACTION_JOB_FORGOTTEN, /* job: too many ended jobs; the core no longer knows it */
	/* who, job, key, text: take the batch of this lease, the last of its (group, part), out of the films; the
	 * earlier states are current again, and the lease goes out once more. Only if the event said that the caller
	 * can. */
	ACTION_TAKE_BACK,
	ACTION_CHAINS_ANEW, /* job, key, text: the chains of this lease start from their seeds (doubt.h) */
	ACTION_WRONG,	    /* who, job, key, text: a worker's noted answer differs from one that two others agree on */
	ACTION_QUARANTINE,  /* who, text: a worker is quarantined permanently */
	ACTION_CLOSE_PEER,  /* peer, text: disconnect; the core has forgotten it already */
};

enum ack { ACK_MERGED, ACK_REPEAT, ACK_REFUSED, ACK_NOTED };

struct action {
	enum action_kind kind;
	enum ack ack;
	enum job_state state;
	enum job_end end;
	bool verified; /* MERGE: two workers agree */
	bool anew;     /* SEND_LEASE: send seeds, whatever its epoch */
	uint64_t tag, peer;
	uint64_t who; /* for MERGE, TAKE_BACK (0: not known), WRONG, QUARANTINE: the worker, whatever its connection
			 (struct peer_status) */
	uint64_t job; /* also set if the action has a key */
	uint64_t rounds;
	struct lease_key key;
	const char *text; /* never NULL */
};

struct update {
	const struct action *actions;
	size_t count;
	double wake; /* send EVENT_TICK at this time unless another event comes first; INFINITY: no need */
};

#endif
