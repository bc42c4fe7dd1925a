/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The input of the coordinator's core (farm.h). The caller owns everything in an event; the core copies what it keeps.
 * Times are seconds of a monotonic clock (an earlier time counts as "no time has passed").
 */
#ifndef COORDINATOR_CORE_EVENT_H
#define COORDINATOR_CORE_EVENT_H

#include "common/film/batch.h"
#include "common/estimate/forecast.h"
#include "common/plan/plan.h"
#include "coordinator/core/job_fields.h"

enum event_kind {
	EVENT_TICK,	 /* only time has passed: due at update.wake at the latest */
	EVENT_JOINED,	 /* join */
	EVENT_LEFT,	 /* peer: its connection is closed */
	EVENT_HEARTBEAT, /* peer: a heartbeat (every other event of a peer counts as one, too) */
	EVENT_REQUEST,	 /* peer, want */
	EVENT_BATCH,	 /* peer, key, valid, text: the result of a lease */
	EVENT_STORED,	 /* key, digest: a stored result of an earlier run, which may count now */
	EVENT_DELIVERED, /* peer, key: its result is received and will be judged later (EVENT_BATCH); the worker may get
			    another lease */
	EVENT_LEASE_FAILED,   /* peer, key, text: the worker failed to compute it */
	EVENT_LEASE_RETURNED, /* peer, key: returned unfinished because the worker is stopping; not a failure */
	EVENT_SUBMIT,	      /* tag, submit */
	EVENT_CANCEL,	      /* tag, job */
	EVENT_PREPARED,	      /* prepared: the answer to ACTION_BOOTSTRAP_DONE */
	EVENT_ERROR_KNOWN,    /* error_known: the answer to ACTION_EVALUATE_ERROR */
	EVENT_IMAGE_KNOWN,    /* image_known: statistics of the final image of ACTION_PUBLISH; the job has ended */
	EVENT_RESTORE, /* tag, restore: continues a job of an earlier run, or one that has ended. Without a tag max_jobs
			  does not apply; only memory can run out */
	EVENT_HOLD,    /* tag, job, hold, text: hands out no more of its leases; an empty text ends this hold */
	EVENT_PRIORITY,	   /* tag, job, priority: from the next lease on */
	EVENT_EXTEND,	   /* tag, job, plan: its own plan with other bounds; not fewer rounds */
	EVENT_QUARANTINED, /* join (without peer, fingerprint, threads), text: a worker quarantined in an earlier run */
	EVENT_JOB_BROKEN,  /* job, text: the job fails (a sum left the grid, the disk is full) */
};

/* Reasons to hold a job, which may apply at the same time; its leases go out when none applies. */
enum job_hold {
	HOLD_STORAGE, /* its results cannot be stored */
	HOLD_FILES,   /* a file of its scene is missing or damaged */
	HOLD_ORDERED, /* a person asked for it */
	JOB_HOLDS,
};

/* SHA-256 over everything in a batch that affects bits. */
struct batch_digest {
	uint8_t bytes[32];
};

enum { JOIN_HOME = 40, JOIN_NAME = 128 /* bytes of the names of a home and of a worker, with the final 0 */ };

struct event_join {
	uint64_t peer;		 /* chosen by the caller, not 0, never reused */
	const char *name;	 /* not empty */
	const char *fingerprint; /* compared for equality only */
	uint32_t threads;
	const char *certificate; /* the name in it; NULL: no certificate */
	const char *home;	 /* the folder that counts its starts; NULL: none */
	uint64_t restarts;	 /* its number of starts */
};

struct event_submit {
	const struct plan *plan; /* must have passed plan_check */
	const char *name;
	int priority;	   /* -100..100 */
	const char *owner; /* the name in the owner's certificate; "": none, and all such jobs have the same owner */
	bool mixed;	   /* accepts workers of any numeric fingerprint */
	double verify; /* share of its leases computed by two workers; ignored for mixed jobs, whose results cannot be
			  compared */
};

/* The state of a job, given by which leases are merged. */
struct event_restore {
	uint64_t job; /* its id */
	struct event_submit submit;
	const char *fingerprint;	 /* "": not pinned */
	enum lease_kind kind;		 /* of its open leases; render: b and seeds exist */
	const uint64_t *next;		 /* [groups][parts]: the first epoch of that kind that is not merged */
	const struct event_join *makers; /* [groups][parts]: who made the previous batch (without peer, fingerprint,
					    threads); name NULL: not known. NULL: none is known */
	bool black;			 /* as in EVENT_PREPARED */
	/* Seconds after its first lease: now, at the start of the first round, at the end of the last complete
	 * round. NAN: not yet. The time between runs is not included. */
	double elapsed, opened, completed;
	const struct forecast_history *looks;
	struct job_counts counts; /* so far */
};

struct event {
	enum event_kind kind;
	double time;
	double unread; /* s: messages of the last so many seconds may not have been read yet, so nobody is blamed for
			  silence in them */
	uint64_t peer;
	uint64_t job;
	uint64_t tag; /* returned in the answer; for events other than SUBMIT and CANCEL there is an answer only if they
			 are refused */
	const char *text;
	union {
		struct event_join join;
		/* How many leases the worker wants to hold in total: its threads, plus one to hide the network's
		 * latency, 0 when it is stopping. Kept until the next request, so the order in which requests and
		 * leases cross on the wire does not matter. */
		uint32_t want;
		struct {
			struct lease_key key;
			bool valid; /* BATCH: it passed batch_check and the frame's checks; otherwise text says what is
				       wrong */
			struct batch_digest digest; /* BATCH, STORED: for leases of which farm_verifies is true */
			bool own;	    /* LEASE_FAILED: the worker's own machine is at fault, not the job */
			bool later;	    /* own: only for now, its memory is in use */
			bool bad_states;    /* LEASE_FAILED: the worker refuses the chain states of the grant */
			bool other_states;  /* ... and these are not the lease's current states, but those of an earlier
					       grant */
			bool can_take_back; /* ... and the batch that produced them can be taken out, and the earlier
					       states are available */
		} lease;
		enum job_hold hold;
		int priority;
		const struct plan *plan;
		struct event_submit submit;
		struct event_restore restore;
		struct {
			uint64_t job;
			bool ok; /* otherwise text says why the job fails */
			bool black;
		} prepared;
		struct {
			uint64_t job, rounds;
			double rel_error; /* square root of the upper end of the estimated relMSE; NAN: not known */
			bool doubtful;	  /* its interval is not known: the job does not end by it */
			double rel_mse, degrees; /* the estimate and its degrees of freedom; 0: not known */
			double cpu_seconds;	 /* of all merged render leases */
			bool black;		 /* the image: it has no error */
		} error_known;
		struct {
			uint64_t job;
			bool disagrees; /* its chains disagree: common/estimate/convergence.h */
		} image_known;
	};
};

#endif
