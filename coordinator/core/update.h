/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What the caller has to do after a step of the core (farm.h): a list of actions, to be carried out in order. The
 * list and its texts belong to the core and are valid until the next farm_step.
 *
 * The comment on each kind of action names the members of struct action that are set.
 */
#ifndef COORDINATOR_CORE_UPDATE_H
#define COORDINATOR_CORE_UPDATE_H

#include "common/film/batch.h"

#include <stdbool.h>
#include <stddef.h>

enum job_state { JOB_QUEUED, JOB_BOOTSTRAP, JOB_RUNNING, JOB_HELD, JOB_DONE, JOB_FAILED, JOB_CANCELLED };

static inline bool job_state_is_end(enum job_state s)
{
	return s == JOB_DONE || s == JOB_FAILED || s == JOB_CANCELLED;
}

enum peer_state { PEER_ACTIVE, PEER_SILENT, PEER_QUARANTINED };

/* Why a job ended. */
enum job_end {
	END_NONE,
	END_MUTATIONS, /* all rounds of the plan are complete */
	END_TIME,
	END_ERROR, /* the target error was reached */
	END_BLACK, /* no sample (of the bootstrap, or of the chains) carried light: the image is black */
	END_CANCELLED,
	END_FAILED,
};

/* What becomes of a result that cannot be judged yet; see answer_judge_delivery (answer.h). */
enum farm_delivery { DELIVERY_AWAITED, DELIVERY_OPEN, DELIVERY_REFUSED };

enum action_kind {
	ACTION_SUBMITTED, /* tag, job: the id of the new job */
	ACTION_CANCELLED, /* tag, job */
	/* tag, text: SUBMIT, CANCEL or another order was refused. Or tag 0, peer, text: JOINED was refused;
	 * disconnect the peer. */
	ACTION_REJECTED,
	/* peer, key: for render leases of PLAN_CHAINS with epoch > 0, send the chain states in the merged batch of
	 * epoch - 1; with epoch 0, send the seeds. The shell keeps one set of states per (job, group, part): that of
	 * the last merge. */
	ACTION_SEND_LEASE,
	ACTION_REVOKE_LEASE, /* peer, key: the worker may drop the lease; if an answer still comes, handle it as usual
			      */
	/* peer, key: merge this event's batch now, exactly once. Comes before all actions that depend on it. */
	ACTION_MERGE_BATCH,
	ACTION_ACKNOWLEDGE, /* peer, key, ack, text: the answer to this event's batch */
	/* job: the bootstrap is complete. Compute b, seeds and canvas, and answer with EVENT_PREPARED, at once or
	 * later. */
	ACTION_BOOTSTRAP_DONE,
	ACTION_ROUND_DONE, /* job, rounds: number of complete rounds, including this event's batch */
	/* job, rounds: estimate the error of exactly this prefix and answer with EVENT_ERROR_ESTIMATED. Later batches
	 * of the job should wait for the answer; a batch that would complete the next round before the answer is
	 * refused, so the prefix does not change. */
	ACTION_ESTIMATE_ERROR,
	ACTION_PUBLISH,	      /* job, rounds: write the image of these rounds; the job is done */
	ACTION_JOB_CHANGED,   /* job, state, end, text */
	ACTION_JOB_FORGOTTEN, /* job: too many jobs have ended; the core no longer knows this one */
	/* worker_id, job, key, text: take the batch of this lease, the last of its (group, part), out of the films. The
	 * earlier states are current again, and the lease goes out once more. Occurs only if the event had
	 * can_roll_back set. */
	ACTION_ROLL_BACK_EPOCH,
	ACTION_RESTART_CHAINS, /* job, key, text: the chains of this lease start from their seeds (doubt.h) */
	/* worker_id, job, key, text: a worker has given a wrong result: its noted answer differs from one that two
	 * others agree on, or it made wrong chain states or refused good ones (doubt.h). */
	ACTION_WRONG_RESULT,
	ACTION_QUARANTINE, /* worker_id, text: a worker is quarantined permanently */
	ACTION_CLOSE_PEER, /* peer, text: disconnect; the core has already forgotten the peer */
};

enum ack { ACK_MERGED, ACK_REPEATED, ACK_REFUSED, ACK_NOTED };

struct action {
	enum action_kind kind;
	enum ack ack;
	enum job_state state;
	enum job_end end;
	bool is_verified;	/* MERGE: two workers have sent equal results, or a journal contained it */
	bool starts_from_seeds; /* SEND_LEASE: send seeds, whatever the epoch */
	uint64_t tag, peer;
	/* MERGE, ROLL_BACK (0: not known), WRONG_RESULT, QUARANTINE: the identity of the worker, whatever its
	 * connection (see struct peer_status). */
	uint64_t worker_id;
	uint64_t job; /* also set if the action has a key */
	uint64_t rounds;
	struct lease_key key;
	const char *text; /* never NULL */
};

struct update {
	const struct action *actions;
	size_t count;
	double wake_time; /* send EVENT_TICK at this time unless another event comes first; INFINITY: not needed */
};

#endif
