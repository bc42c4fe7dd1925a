/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What happened, as input of the coordinator's core (farm.h). The caller owns everything in an event; the core copies
 * what it keeps. Times are seconds on a clock that never goes back (the core treats an earlier time as "no time
 * passed").
 */
#ifndef COORDINATOR_CORE_EVENT_H
#define COORDINATOR_CORE_EVENT_H

#include "common/film/batch.h"
#include "common/estimate/forecast.h"
#include "common/plan/plan.h"
#include "coordinator/core/counts.h"

enum event_kind {
	EVENT_TICK,	 /* nothing but time: at update.wake at the latest */
	EVENT_JOINED,	 /* join */
	EVENT_LEFT,	 /* peer: its connection is gone */
	EVENT_HEARTBEAT, /* peer: a heartbeat (every other event of a peer counts as one) */
	EVENT_REQUEST,	 /* peer, want */
	EVENT_BATCH,	 /* peer, key, valid, text: the result of a lease */
	EVENT_STORED, /* key, digest: the result of a lease from an earlier run, which could not count before: it does
			 now if it can */
	EVENT_DELIVERED, /* peer, key: its result is here and will be looked at later (EVENT_BATCH): it may have another
			    lease */
	EVENT_LEASE_FAILED,   /* peer, key, text: the worker tried and could not */
	EVENT_LEASE_RETURNED, /* peer, key: given up unfinished (the worker is stopping); nobody's fault */
	EVENT_SUBMIT,	      /* tag, submit */
	EVENT_CANCEL,	      /* tag, job */
	EVENT_PREPARED,	      /* prepared: the answer to ACTION_BOOTSTRAP_DONE */
	EVENT_ERROR_KNOWN,    /* error_known: the answer to ACTION_EVALUATE_ERROR */
	EVENT_IMAGE_KNOWN,    /* image_known: what the final image of ACTION_PUBLISH says; the job has ended */
	EVENT_RESTORE,	/* tag, restore: a job of an earlier run goes on, or one that has ended. Without a tag there are
			   never too many: only memory can be out */
	EVENT_HOLD,	/* tag, job, hold, text: no more of its leases go out; without a text this hold is over */
	EVENT_PRIORITY, /* tag, job, priority: from the next lease on */
	EVENT_EXTEND,	/* tag, job, plan: its own, but for the bounds; not fewer rounds */
	EVENT_QUARANTINED, /* join (but for peer, fingerprint, threads), text: a worker quarantined in an earlier run */
	EVENT_JOB_BROKEN,  /* job, text: the caller cannot go on with it (a sum left the grid, the disk is full) */
};

/* A job may be held for each of these at once; its leases go out when it is held for none. */
enum job_hold {
	HOLD_STORAGE, /* its results cannot be stored */
	HOLD_FILES,   /* a file of its scene is gone or damaged */
	HOLD_ORDERED, /* somebody wants it so */
	JOB_HOLDS,
};

/* SHA-256 over what of a batch decides bits. */
struct batch_digest {
	uint8_t bytes[32];
};

enum { JOIN_HOME = 40, JOIN_NAME = 128 /* bytes of a home's name and of a worker's, their ends included */ };

struct event_join {
	uint64_t peer;		 /* chosen by the caller, not 0, never used twice while the farm is there */
	const char *name;	 /* not empty */
	const char *fingerprint; /* compared as a whole */
	uint32_t threads;
	const char *certificate; /* the name in it; NULL: none */
	const char *home;	 /* the folder that counts its starts; NULL: nobody does */
	uint64_t restarts;	 /* so many there have been */
};

struct event_submit {
	const struct plan *plan; /* checked by plan_check */
	const char *name;
	int priority; /* -100..100 */
	const char
		*owner; /* the name that its certificate says; "": there is none, and all such jobs are one owner's */
	bool mixed;	/* workers of any numeric fingerprint */
	double verify;	/* share of its leases that two workers compute; not where it is mixed: only equals can be
			   compared */
};

/* Which leases are merged says where a job was. */
struct event_restore {
	uint64_t job; /* its id */
	struct event_submit submit;
	const char *fingerprint;	 /* "": it belongs to none */
	enum lease_kind kind;		 /* of its open leases; render: b and seeds are there */
	const uint64_t *next;		 /* [groups][parts]: the first epoch of that kind that is not merged */
	const struct event_join *makers; /* as many: who gave the batch before (but for peer, fingerprint, threads);
					    name NULL: not known. NULL: of none of them */
	bool black;			 /* as EVENT_PREPARED said */
	/* Seconds after its first lease: now, when the first round opened, when the last round was complete. NAN: was
	 * not yet. The time between runs does not count. */
	double elapsed, opened, completed;
	const struct forecast_history *looks;
	struct job_counts counts; /* so far */
};

struct event {
	enum event_kind kind;
	double time;
	double unread; /* s: what has come in the last so many may not have been read: nobody is missed for being silent
			  in them */
	uint64_t peer;
	uint64_t job;
	uint64_t tag; /* comes back in the answer; but to SUBMIT and CANCEL there is one only when it is refused */
	const char *text;
	union {
		struct event_join join;
		/* How many leases the worker wants to hold at once, those that it has included: its threads, one more
		 * to hide the network's latency, 0 when it is stopping. Remembered until the next request, so that
		 * nothing depends on how requests and leases cross on the wire. */
		uint32_t want;
		struct {
			struct lease_key key;
			bool valid; /* BATCH: batch_check and the frame's own checks passed; else text says what is
				       wrong */
			struct batch_digest digest; /* BATCH, STORED: of a lease that farm_verifies */
			bool own;	 /* LEASE_FAILED: it says that its own machine is at fault, not the job */
			bool bad_states; /* LEASE_FAILED: it says that the chains cannot go on from the states that came
					    with it */
			bool other_states;  /* ... and these are not the ones that the lease begins with now: it was
					       given before with others */
			bool can_take_back; /* ... and the batch that these came with can be taken out, and the states
					       before it are there */
		} lease;
		enum job_hold hold;
		int priority;
		const struct plan *plan;
		struct event_submit submit;
		struct event_restore restore;
		struct {
			uint64_t job;
			bool ok; /* else text says why the job cannot go on */
			bool black;
		} prepared;
		struct {
			uint64_t job, rounds;
			double rel_error; /* sqrt of the upper end of the estimated relMSE; NAN: cannot be known */
			bool doubtful;	  /* its interval is not known: no job ends by it */
			double rel_mse, degrees; /* the estimate, and its degrees of freedom; 0: not known */
			double cpu_seconds;	 /* of all merged render leases */
		} error_known;
		struct {
			uint64_t job;
			bool disagrees; /* its chains do: common/estimate/convergence.h */
		} image_known;
	};
};

#endif
